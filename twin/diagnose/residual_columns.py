"""Columns of the residuals of every kind of data, for any covariance; and those in which sound rigs differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.whitening import Whitening, real_ones

KINDS = ("broadband", "steps", "harmonics")
"""Of data, in the order of a residual's blocks."""


@dataclass(frozen=True)
class ResidualColumns:
    """Columns of the residuals, such as their sensitivities, that are not whitened."""

    broadband: tuple[Array, ...]
    """Of each run, (b, o, k)."""
    steps: Array
    """Array (s, 2 o, k)."""
    harmonics: Array
    """Array (s, h, o, k)."""

    @classmethod
    def of(cls, rows: Array, blocks: tuple[tuple[str, slice], ...], held: Linearisation) -> ResidualColumns:
        """From columns (r, k) of a residual that was whitened with what is held."""
        where = dict(blocks)

        def complex_ones(name: str, whitening: Whitening) -> Array:
            real, imaginary = np.split(rows[where[name]], 2)
            return whitening.undone((real + 1j * imaginary) / np.sqrt(2))

        harmonics = np.zeros((0, 0, 0, rows.shape[1]), complex)
        if "harmonics" in where:
            assert held.harmonics is not None
            harmonics = complex_ones("harmonics", held.harmonics)
        return cls(
            tuple(complex_ones(f"broadband {number}", white) for number, white in enumerate(held.broadband)),
            held.steps.undone(rows[where["steps"]] if "steps" in where else rows[:0]),
            harmonics,
        )

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.harmonics.shape[-1])

    def beside(self, others: ResidualColumns) -> ResidualColumns:
        """These and then the others."""
        pairs = zip(self.broadband, others.broadband, strict=True)
        return ResidualColumns(
            tuple(np.concatenate(pair, axis=-1) for pair in pairs),
            np.concatenate([self.steps, others.steps], axis=-1),
            np.concatenate([self.harmonics, others.harmonics], axis=-1),
        )

    def of_kind(self, kind: str) -> tuple[Array, ...]:
        """Those of one kind of data."""
        return self.broadband if kind == "broadband" else (getattr(self, kind),)

    def felt(self, kind: str) -> NDArray[np.int64]:
        """Numbers of the columns that are not zero in one kind of data."""
        each = [np.any(values, axis=tuple(range(values.ndim - 1))) for values in self.of_kind(kind)]
        return np.flatnonzero(np.any(each, axis=0))

    def select(self, numbers: NDArray[np.int64]) -> ResidualColumns:
        """Some of them."""
        broadband = tuple(values[..., numbers] for values in self.broadband)
        return ResidualColumns(broadband, self.steps[..., numbers], self.harmonics[..., numbers])

    def white(self, kind: str, whitenings: tuple[Whitening, ...]) -> Array:
        """Those of one kind of data whitened (r, k); a complex number counts as two real ones."""
        found = []
        for values, whitening in zip(self.of_kind(kind), whitenings, strict=False):
            white = whitening.columns(values)
            found.append(real_ones(white) if np.iscomplexobj(white) else white)
        return found[0] if len(found) == 1 else np.vstack([np.zeros((0, self.count)), *found])

    def whitened(self, held: Linearisation) -> Array:
        """As columns (r, k) of a residual that is whitened with what is held."""
        harmonics = () if held.harmonics is None else (held.harmonics,)
        whitenings = (held.broadband, (held.steps,), harmonics)
        return np.vstack([self.white(kind, each) for kind, each in zip(KINDS, whitenings, strict=True)])


def tolerances_of(columns: Array, blocks: tuple[tuple[str, slice], ...], held: Linearisation) -> ResidualColumns:
    """Directions of the residuals in which sound rigs differ from any model, each with a standard normal amount.

    No rig is exactly the nominal one: sensors, masses, dampers are a little off, and the mesh is coarse; and no rig is
    the same from sweep to sweep.  What that does to the data is known, from the causes' signatures (r, k) and from the
    sensitivities to natural frequencies where the shifts of these are no unknowns, and integrated over.
    """
    found = ResidualColumns.of(columns, blocks, held)
    if len(held.baseline.shifts):
        return found
    assert held.made_of is not None
    runs, sweeps = held.made_of.shifts
    none = np.zeros((*found.harmonics.shape[:-1], sweeps.shape[2]))
    return found.beside(ResidualColumns(runs, sweeps, none))
