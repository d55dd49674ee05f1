"""Mode shapes from residues."""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True)
class Shape:
    """A mode's shape."""

    values: Array
    """Complex, the largest of size one; turned so that they lie along the real axis as well as they can, (d,)."""
    phase_scatter_deg: float
    """How far they are from lying on it: 0 of a mode whose places all move in phase or against it, 45 of none."""


def shape_of(residues: Array) -> Shape:
    """The shape at the rows of a mode's residues (d, o), of which each column is that shape times a factor."""
    left, size, _ = np.linalg.svd(residues, full_matrices=False)
    values = left[:, 0] * size[0]
    values = values * np.exp(-0.5j * np.angle(np.sum(values**2)))
    largest = values[int(np.argmax(np.abs(values)))]
    values = values / (np.abs(largest) * (np.sign(largest.real) or 1.0))
    off, along = np.linalg.norm(values.imag), np.linalg.norm(values.real)
    return Shape(values, float(np.degrees(np.arctan2(off, along))))


def mac_matrix(one: Array, other: Array) -> Array:
    """Modal assurance criterion of the columns of two sets of shapes, (d, r) and (d, m): (r, m)."""
    product = np.abs(np.conj(one).T @ other) ** 2
    norms = [np.sum(np.abs(each) ** 2, axis=0) for each in (one, other)]
    return np.asarray(product / np.maximum(np.outer(*norms), np.finfo(float).tiny))
