"""Long signals by their extremes: of each short stretch the least and the greatest, so that no peak is lost."""

import numpy as np

from twin.arrays import Array


def extremes(values: Array, stretch: int) -> tuple[Array, Array]:
    """Positions and values of the least and the greatest of each stretch, in order of time.

    Parameters
    ----------
    values : ndarray, (n,)
        NaN where samples were lost.
    stretch
        Samples in a stretch; with fewer than three all samples are kept, as they are at the end that fills no stretch.
    """
    if stretch < 3:
        return np.arange(len(values)), values.astype(float)
    whole = len(values) // stretch * stretch
    table = values[:whole].reshape(-1, stretch)
    low, high = np.where(np.isnan(table), np.inf, table), np.where(np.isnan(table), -np.inf, table)
    picked = np.sort(np.stack([low.argmin(axis=1), high.argmax(axis=1)], axis=1), axis=1)
    position = np.unique((picked + np.arange(len(table))[:, None] * stretch).ravel())
    position = np.concatenate([position, np.arange(whole, len(values))])
    return position, values[position].astype(float)
