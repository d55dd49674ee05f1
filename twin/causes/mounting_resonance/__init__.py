"""A sensor resonates on its mount: wax gone soft, a loose stud, a magnet base."""
