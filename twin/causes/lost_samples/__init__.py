"""Stretches of one channel in which the last value is repeated, as a driver fills gaps it does not report."""
