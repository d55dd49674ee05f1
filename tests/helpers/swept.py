"""Frequencies of two synthetic sweeps, and of a broadband run."""

import numpy as np

SWEPT = 2 * np.pi * np.linspace(25.6, 27.2, 25)
"""Of each sweep, rad/s."""
BAND_Hz = np.geomspace(8.0, 950.0, 45)
