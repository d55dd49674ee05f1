"""A converter coarser than believed, or a range chosen far too large."""
