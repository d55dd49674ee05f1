"""A mass nobody told the model of: a cable clamp, a heavier sensor, a magnet left on."""
