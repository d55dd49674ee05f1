"""Exact natural frequencies of plane frames: Euler-Bernoulli dynamic stiffness, counted after Wittrick and Williams.

Also mass and stiffness of layered beams from their energies.  Nothing of the package is used here.
W. H. Wittrick and F. W. Williams, Q. J. Mech. Appl. Math. 24 (1971) 263.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

__all__ = ["Bar", "ExactFrame", "at_angle", "clamped_count", "dynamic_stiffness", "energies"]


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
            D[np.ix_(dofs, dofs)] += turn.T @ dynamic_stiffness(bar, length, omega) @ turn
            clamped += clamped_count(bar, length, omega)
        for motion, stiffness in self.springs.items():
            D[motions.index(motion), motions.index(motion)] += stiffness
        free = [number for number, motion in enumerate(motions) if motion not in self.held]
        return clamped + int(np.sum(np.linalg.eigvalsh(D[np.ix_(free, free)]) < 0))


def at_angle(angle: float, x: float, y: float) -> tuple[float, float]:
    """A point turned about the origin."""
    return float(np.cos(angle) * x - np.sin(angle) * y), float(np.sin(angle) * x + np.cos(angle) * y)


def energies(beams: list[tuple], layers: list[tuple], h: float) -> tuple[np.ndarray, np.ndarray]:
    """M and K of beams along x, (begin, end, section), in elements of length h, by Gauss points of their energies.

    A layer is (bottom beam, top beam, begin, end, height, width, E', G').
    """
    first = np.concatenate([[0], np.cumsum([3 * (round((e - b) / h) + 1) for b, e, _ in beams])])
    M, K = np.zeros((2, first[-1], first[-1]))

    def rows(number, x):
        """Of u, v, v', u' and v'' of a beam at x."""
        begin, end, _ = beams[number]
        element = min(int((x - begin) / h), round((end - begin) / h) - 1)
        s = (x - begin) / h - element
        found, dof = np.zeros((5, first[-1])), first[number] + 3 * element
        bend = [dof + 1, dof + 2, dof + 4, dof + 5]
        found[0, [dof, dof + 3]] = 1 - s, s
        found[1, bend] = 1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)
        found[2, bend] = (6 * s**2 - 6 * s) / h, 1 - 4 * s + 3 * s**2, (6 * s - 6 * s**2) / h, 3 * s**2 - 2 * s
        found[3, [dof, dof + 3]] = -1 / h, 1 / h
        found[4, bend] = (12 * s - 6) / h**2, (6 * s - 4) / h, (6 - 12 * s) / h**2, (6 * s - 2) / h
        return found

    def stations(begin, end):
        points, weights = np.polynomial.legendre.leggauss(6)
        for a in begin + h * np.arange(round((end - begin) / h)):
            yield from zip(a + h * (points + 1) / 2, h * weights / 2, strict=True)

    for number, (begin, end, b) in enumerate(beams):
        A, E = b["width"] * b["thickness"], b["youngs_modulus"]
        for x, w in stations(begin, end):
            u, v, _, stretch, curved = rows(number, x)
            M += w * b["density"] * A * (np.outer(u, u) + np.outer(v, v))
            K += w * E * A * (np.outer(stretch, stretch) + b["thickness"] ** 2 / 12 * np.outer(curved, curved))
    for bottom, top, begin, end, height, width, E, G in layers:
        for x, w in stations(begin, end):
            (u1, v1, s1, *_), (u2, v2, s2, *_) = rows(bottom, x), rows(top, x)
            slip = u2 - u1 + (beams[top][2]["thickness"] * s2 + beams[bottom][2]["thickness"] * s1) / 2
            K += w * width / height * (E * np.outer(v2 - v1, v2 - v1) + G * np.outer(slip, slip))
    return M, K


def _waves(bar: Bar, length: float, omega: float) -> tuple[float, float]:
    """Phases along the bar of a longitudinal and of a bending wave."""
    bending = length * (bar.mass_per_length * omega**2 / bar.EI) ** 0.25
    return length * omega * float(np.sqrt(bar.mass_per_length / bar.EA)), float(bending)


def dynamic_stiffness(bar: Bar, length: float, omega: float) -> np.ndarray:
    """Over displacement along, across and turn of either end."""
    mu, b = _waves(bar, length, omega)
    D = np.zeros((6, 6))
    D[np.ix_([0, 3], [0, 3])] = bar.EA / length * mu * np.array([[np.cos(mu), -1], [-1, np.cos(mu)]]) / np.sin(mu)
    if b < 0.05:
        # Their limits, to b^8, where the formulas below lose their digits.
        L, mass = length, bar.mass_per_length * length / 420 * omega**2
        near = bar.EI / L**3 * np.array([[12, 6 * L], [6 * L, 4 * L**2]]) - mass * np.array(
            [[156, 22 * L], [22 * L, 4 * L**2]]
        )
        far = bar.EI / L**3 * np.array([[-12, 6 * L], [-6 * L, 2 * L**2]]) - mass * np.array(
            [[54, -13 * L], [13 * L, -3 * L**2]]
        )
        return _both_ends(D, near, far)
    s, c, sh, ch = np.sin(b), np.cos(b), np.sinh(b), np.cosh(b)
    root = 1 - c * ch
    shear, far_shear = b**3 * (s * ch + c * sh) / root, -(b**3) * (s + sh) / root
    couple, far_couple = b**2 * s * sh / root, b**2 * (ch - c) / root
    turn, far_turn = b * (s * ch - c * sh) / root, b * (sh - s) / root
    unit = np.array([length, 1.0])
    near = bar.EI / length * np.array([[shear, couple], [couple, turn]]) / np.outer(unit, unit)
    far = bar.EI / length * np.array([[far_shear, far_couple], [-far_couple, far_turn]]) / np.outer(unit, unit)
    return _both_ends(D, near, far)


def _both_ends(D: np.ndarray, near: np.ndarray, far: np.ndarray) -> np.ndarray:
    flip = np.diag([1.0, -1.0])
    D[1:3, 1:3], D[1:3, 4:6], D[4:6, 1:3], D[4:6, 4:6] = near, far, far.T, flip @ near @ flip
    return D


def clamped_count(bar: Bar, length: float, omega: float) -> int:
    """How many natural frequencies of the bar with both ends held lie below."""
    mu, b = _waves(bar, length, omega)
    whole = int(b / np.pi)
    sign = np.sign(1 - np.cosh(b) * np.cos(b))
    return int(mu / np.pi) + whole - int((1 - (-1) ** whole * sign) / 2)
