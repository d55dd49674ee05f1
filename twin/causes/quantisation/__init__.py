"""A converter coarser than assumed, or a range chosen far too large."""
