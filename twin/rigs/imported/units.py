"""Units of a model: which there are, which these matrices are likely to be in, and the matrices in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from twin.arrays import Array
from twin.rigs.limits import LIMITS
from twin.rigs.matrices.found import scaled

Rows = Mapping[tuple[int, str], int]


@dataclass(frozen=True)
class Units:
    """A consistent set: metres, kilograms and seconds of its units."""

    name: str
    length_m: float
    mass_kg: float
    time_s: float

    @property
    def energy_J(self) -> float:
        """Of one unit of energy."""
        return self.mass_kg * self.length_m**2 / self.time_s**2

    @property
    def density(self) -> float:
        """Steel's, in these units."""
        return 7850.0 * self.length_m**3 / self.mass_kg

    def to_si(self, M: csr_array, K: csr_array, rows: Rows) -> tuple[csr_array, csr_array]:
        """Mass and stiffness in SI units: rotations stay as they are, all else becomes metres."""
        scale = np.full(M.shape[0], 1 / self.length_m)
        scale[[row for (_, dof), row in rows.items() if dof in ("rx", "ry", "rz")]] = 1.0
        return self.energy_J * self.time_s**2 * scaled(M, scale), self.energy_J * scaled(K, scale)


UNITS = {
    units.name: units
    for units in (
        Units("m-kg-s", 1.0, 1.0, 1.0),
        Units("mm-t-s", 1e-3, 1e3, 1.0),
        Units("mm-kg-ms", 1e-3, 1.0, 1e-3),
        Units("in-lbf-s", 0.0254, 175.126835, 1.0),
    )
}
"""Newton, millimetre and tonne; kilonewton, millimetre, kilogram and millisecond; pound-force, inch and second."""


@dataclass(frozen=True)
class ModelScale:
    """What of a model tells its units: its size, and its speed of sound; NaN where it does not tell."""

    size: float
    sound: float

    def unlikely(self, units: Units) -> float:
        """Decades by which the model would be unusual in these units."""
        sound = self.sound * units.length_m / units.time_s / LIMITS.units_sound_m_per_s
        return abs(np.log10(sound)) + LIMITS.units_unlikely * abs(
            np.log10(self.size * units.length_m / LIMITS.units_size_m)
        )

    def guess(self) -> Units | None:
        """The likely units; None where two are about as likely, or nothing tells them."""
        if not (self.size > 0 and self.sound > 0):
            return None
        first, second = sorted(UNITS.values(), key=self.unlikely)[:2]
        return first if self.unlikely(second) - self.unlikely(first) > LIMITS.least_decades else None

    def doubt(self, units: Units) -> str:
        """Why these units are doubted; empty if they are not; ValueError if no unit explains these matrices."""
        sound = self.sound * units.length_m / units.time_s
        off = abs(np.log10(sound / LIMITS.units_sound_m_per_s)) if sound > 0 else 0.0
        if off < LIMITS.units_strange:
            return ""
        told = f"in {units.name} sound would run at {sound:.2g} m/s, which is no solid's"
        if off > LIMITS.units_impossible:
            raise ValueError(told)
        return f"{told}: check units and matrices"


def model_scale(M: csr_array, K: csr_array, coordinates: Array, rows: Rows) -> ModelScale:
    """Size and speed of sound of a model in its own units.

    The largest frequency that an element's mass and stiffness have, times the distance of its nodes, is about the speed
    of sound, whatever the shape: taken from the stiffest tenth of the displacements' rows.
    """
    size = float(np.linalg.norm(np.ptp(coordinates, axis=0)))
    places = np.unique(coordinates, axis=0)
    moving = np.array([row for (_, dof), row in rows.items() if dof in ("x", "y", "z")], np.int64)
    mass, stiffness = M.diagonal()[moving], K.diagonal()[moving]
    felt = (mass > 0) & (stiffness > 0)
    if not np.any(felt) or len(places) < 2:
        return ModelScale(size, np.nan)
    return ModelScale(size, usual_spacing(places) * float(np.sqrt(np.quantile(stiffness[felt] / mass[felt], 0.9))))


def usual_spacing(places: Array) -> float:
    """Usual distance from a node (n, 3) to the next."""
    return float(np.median(KDTree(places).query(places, k=2)[0][:, 1]))
