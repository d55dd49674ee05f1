"""Noise of complex amplitudes."""

import numpy as np


def circular(rng, size, shape):
    """Complex normal variables with E|z|^2 = size^2."""
    return size / np.sqrt(2) * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
