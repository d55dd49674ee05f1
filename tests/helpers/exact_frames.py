"""Exact natural frequencies of plane frames: Euler-Bernoulli dynamic stiffness, counted after Wittrick and Williams.

Nothing of the package is used here.  W. H. Wittrick and F. W. Williams, Q. J. Mech. Appl. Math. 24 (1971) 263.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

__all__ = ["Bar", "ExactFrame", "at_angle"]


@dataclass(frozen=True)
class Bar:
    """A uniform rectangular beam from one corner of the frame to another."""

    begin: str
    end: str
    width: float
    thickness: float
    youngs_modulus: float
    density: float

    @property
    def EA(self) -> float:
        return self.youngs_modulus * self.width * self.thickness

    @property
    def EI(self) -> float:
        return self.youngs_modulus * self.width * self.thickness**3 / 12

    @property
    def mass_per_length(self) -> float:
        return self.density * self.width * self.thickness


@dataclass(frozen=True)
class ExactFrame:
    """Corners by name with x and y, bars between them; what is held or on springs by corner and motion."""

    corners: dict[str, tuple[float, float]]
    bars: list[Bar]
    held: set[tuple[str, str]] = field(default_factory=set)
    springs: dict[tuple[str, str], float] = field(default_factory=dict)

    def frequencies_Hz(self, count: int, *, lowest_Hz: float = 0.5) -> np.ndarray:
        """The first so many above `lowest_Hz`, below which rigid motions are counted."""
        below = self.count(2 * np.pi * lowest_Hz)
        found = []
        for number in range(below + 1, below + count + 1):
            low, high = 2 * np.pi * lowest_Hz, 4 * np.pi * lowest_Hz
            while self.count(high) < number:
                low, high = high, 2 * high
            while high / low > 1 + 1e-11:
                middle = (low + high) / 2
                low, high = (middle, high) if self.count(middle) < number else (low, middle)
            found.append(high / (2 * np.pi))
        return np.array(found)

    def count(self, omega: float) -> int:
        """How many natural frequencies lie below."""
        names = list(self.corners)
        motions = [(name, motion) for name in names for motion in ("x", "y", "rz")]
        D, clamped = np.zeros((len(motions), len(motions))), 0
        for bar in self.bars:
            along = np.subtract(self.corners[bar.end], self.corners[bar.begin])
            length = float(np.hypot(*along))
            c, s = along / length
            turn = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
            dofs = np.concatenate([3 * names.index(corner) + np.arange(3) for corner in (bar.begin, bar.end)])
            D[np.ix_(dofs, dofs)] += turn.T @ _dynamic_stiffness(bar, length, omega) @ turn
            clamped += _clamped_count(bar, length, omega)
        for motion, stiffness in self.springs.items():
            D[motions.index(motion), motions.index(motion)] += stiffness
        free = [number for number, motion in enumerate(motions) if motion not in self.held]
        return clamped + int(np.sum(np.linalg.eigvalsh(D[np.ix_(free, free)]) < 0))


def at_angle(angle: float, x: float, y: float) -> tuple[float, float]:
    """A point turned about the origin."""
    return float(np.cos(angle) * x - np.sin(angle) * y), float(np.sin(angle) * x + np.cos(angle) * y)


def _waves(bar: Bar, length: float, omega: float) -> tuple[float, float]:
    """Phases along the bar of a longitudinal and of a bending wave."""
    bending = length * (bar.mass_per_length * omega**2 / bar.EI) ** 0.25
    return length * omega * float(np.sqrt(bar.mass_per_length / bar.EA)), float(bending)


def _dynamic_stiffness(bar: Bar, length: float, omega: float) -> np.ndarray:
    """Over displacement along, across and turn of either end."""
    mu, b = _waves(bar, length, omega)
    s, c, sh, ch = np.sin(b), np.cos(b), np.sinh(b), np.cosh(b)
    root = 1 - c * ch
    shear, far_shear = b**3 * (s * ch + c * sh) / root, -(b**3) * (s + sh) / root
    couple, far_couple = b**2 * s * sh / root, b**2 * (ch - c) / root
    turn, far_turn = b * (s * ch - c * sh) / root, b * (sh - s) / root
    unit = np.array([length, 1.0])
    near = bar.EI / length * np.array([[shear, couple], [couple, turn]]) / np.outer(unit, unit)
    far = bar.EI / length * np.array([[far_shear, far_couple], [-far_couple, far_turn]]) / np.outer(unit, unit)
    flip = np.diag([1.0, -1.0])
    D = np.zeros((6, 6))
    D[1:3, 1:3], D[1:3, 4:6], D[4:6, 1:3], D[4:6, 4:6] = near, far, far.T, flip @ near @ flip
    axial = bar.EA / length * mu * np.array([[1 / np.tan(mu), -1 / np.sin(mu)], [-1 / np.sin(mu), 1 / np.tan(mu)]])
    D[np.ix_([0, 3], [0, 3])] = axial
    return D


def _clamped_count(bar: Bar, length: float, omega: float) -> int:
    """How many natural frequencies of the bar with both ends held lie below."""
    mu, b = _waves(bar, length, omega)
    whole = int(b / np.pi)
    sign = np.sign(1 - np.cosh(b) * np.cos(b))
    return int(mu / np.pi) + whole - int((1 - (-1) ** whole * sign) / 2)
