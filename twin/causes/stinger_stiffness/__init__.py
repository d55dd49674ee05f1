"""The stinger holds the beam at the drive point, and the force cell does not see it."""
