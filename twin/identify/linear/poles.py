"""Poles of a frequency response that can be evaluated anywhere, such as a model's with whatever it was extended by."""

from collections.abc import Callable

import numpy as np
from scipy.signal import find_peaks

from twin.arrays import Array

AROUND, GRID = 0.02, 401
"""How far beside a guess its peak is looked for, over the guess' frequency; and at how many places."""
WIDTHS, PLACES, TURNS = 1.0, 9, 8
"""Half widths on either side of a pole to which it is fitted, at how many places, and how often at most."""


def poles_near(response: Callable[[Array], Array], guesses: Array) -> Array:
    """The poles next to guesses.

    Near a pole p each response is a residue over (j omega - p) and a rest that hardly bends, so that
    j omega H = p H + a + b omega + c omega^2: linear in p, which all responses share.

    Parameters
    ----------
    response
        Responses (f, o) at omega (f,), rad/s.
    guesses : ndarray, (p,)
        With positive imaginary and negative real parts, rad/s.

    Returns
    -------
    ndarray, (p,)
        A guess stays as it is where there is no peak beside it.
    """
    peaks = _peaks(response, guesses)
    poles = np.where(peaks > 0, guesses.real + 1j * peaks, guesses)
    for _ in range(TURNS):
        before = poles
        poles = _fitted(response, poles)
        if np.all(np.abs(poles - before) < 1e-6 * np.abs(before.real)):
            break
    sound = (peaks > 0) & (poles.real < 0) & (np.abs(poles.imag - guesses.imag) < AROUND * guesses.imag)
    return np.where(sound, poles, guesses)


def _peaks(response: Callable[[Array], Array], guesses: Array) -> Array:
    """The peak of the responses next to each guess; 0 where there is none."""
    omega = guesses.imag[:, None] * np.linspace(1 - AROUND, 1 + AROUND, GRID)
    level = np.sum(np.abs(response(omega.ravel())), axis=1).reshape(omega.shape)
    found = [find_peaks(row)[0] for row in level]
    nearest = [peaks[np.argmin(np.abs(peaks - GRID // 2))] if len(peaks) else -1 for peaks in found]
    return np.array([row[place] if place >= 0 else 0.0 for row, place in zip(omega, nearest, strict=True)])


def _fitted(response: Callable[[Array], Array], poles: Array) -> Array:
    half_width = np.clip(-poles.real, 1e-6 * poles.imag, AROUND / WIDTHS * poles.imag)
    away = half_width[:, None] * np.linspace(-WIDTHS, WIDTHS, PLACES)
    H = response((poles.imag[:, None] + away).ravel()).reshape(*away.shape, -1)
    found = [_fit(x / w, part) * w for x, part, w in zip(away, H, half_width, strict=True)]
    return 1j * poles.imag + np.array(found)


def _fit(x: Array, H: Array) -> complex:
    """The pole p of responses (f, o) at x: j x H = p H + a + b x + c x^2 with a, b and c of each response."""
    outputs = H.shape[1]
    columns = [H.T.reshape(-1, 1)]
    columns += [np.kron(np.eye(outputs), power[:, None]) for power in (np.ones_like(x), x, x**2)]
    A = np.hstack(columns)
    norm = np.linalg.norm(A, axis=0) + 1e-300
    return complex(np.linalg.lstsq(A / norm, (1j * x[:, None] * H).T.ravel(), rcond=None)[0][0] / norm[0])
