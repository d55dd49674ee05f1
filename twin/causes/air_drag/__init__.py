"""Air that resists with the square of the velocity, all along the beams."""
