"""A mass between force cell and beam: a stud, wax, the cell's own live side."""
