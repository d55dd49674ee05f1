"""A channel's sensitivity is wrong: a mistyped calibration, a gain switch."""
