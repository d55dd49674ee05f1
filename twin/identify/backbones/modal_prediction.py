"""Response of a rig of kind modal: force for a given acceleration, or every acceleration that a force may give."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.rigs.modal import ModalLaw

GRID_POINTS = 3000


@dataclass(frozen=True)
class ModalResponse:
    """One row a solution; a step with three solutions has three rows."""

    step: NDArray[np.int64]
    """Row of the drive that each solution belongs to, (r,)."""
    frequency_Hz: Array
    force_N: Array
    acceleration_m_per_s2: Array
    std: Array
    phase_rad: Array
    """All (r,); `std` is of the quantity not given, in its unit; the phase is the displacement's against the force."""
    branch: NDArray[np.int64]
    """0 for the smallest solution of a step, rising with amplitude, (r,)."""
    stable: NDArray[np.bool_]
    """Whether a slow force-controlled sweep can rest there: the force rises with the amplitude, (r,)."""

    @property
    def branches(self) -> int:
        """Largest number of solutions of one step."""
        return int(self.branch.max()) + 1 if len(self.branch) else 0


def modal_receptance(
    law: ModalLaw, frequency_Hz: Array, amplitude: Array, *, shift_Hz: float = 0.0, damping_factor: float = 1.0
) -> Array:
    """Displacement per force at acceleration amplitudes `amplitude` (m/s2), broadcast against the frequencies."""
    knots = np.array(law.amplitude_m_per_s2)
    a = np.clip(amplitude, knots[0], knots[-1])
    W = 2 * np.pi * (PchipInterpolator(knots, law.frequency_Hz)(a) + shift_Hz)
    zeta = PchipInterpolator(knots, law.damping_ratio)(a) * damping_factor
    W0 = 2 * np.pi * law.frequency_Hz[0]
    w = 2 * np.pi * np.asarray(frequency_Hz)
    mode = 1 / (law.modal_mass_kg * (W**2 - w**2 + 2j * zeta * W**2))
    return np.asarray(np.exp(1j * law.phase_rad) * (mode + law.residual / (law.modal_mass_kg * W0**2)))


def predict_held(law: ModalLaw, frequency_Hz: Array, acceleration_m_per_s2: Array) -> ModalResponse:
    """The force that holds given acceleration amplitudes, unique, with its standard deviation."""
    f, A = np.asarray(frequency_Hz, float), np.asarray(acceleration_m_per_s2, float)
    H = modal_receptance(law, f, A)
    force = A / ((2 * np.pi * f) ** 2 * np.abs(H))
    relative = _relative_force_std(law, f, A)
    stable = _slope(law, f, A) > 0
    return ModalResponse(
        np.arange(len(f)), f, force, A, relative * force, np.angle(H), np.zeros(len(f), np.int64), stable
    )


def predict_forced(law: ModalLaw, frequency_Hz: Array, force_N: Array) -> ModalResponse:
    """Every steady acceleration that given force amplitudes can hold, branch by branch.

    At each step the force needed for an amplitude is a function of the amplitude; its crossings of the given force are
    the solutions.  The standard deviation is that force's, divided by its slope, and no larger than the amplitude.
    """
    f, F = np.asarray(frequency_Hz, float), np.asarray(force_N, float)
    # A quadratic grid: fine where small forces have their solutions.
    largest = _largest(law, f, F)
    rows: list[tuple[int, float, int]] = []
    for i, (frequency, force) in enumerate(zip(f, F, strict=True)):
        A = largest[i] * np.linspace(0.0, 1.0, GRID_POINTS)[1:] ** 2
        excess = _force(law, np.full(len(A), frequency), A) - force
        crossing = np.flatnonzero(np.signbit(excess[:-1]) != np.signbit(excess[1:]))
        start = [A[0] * force / (force + excess[0])] if excess[0] >= 0 else []  # linear below the grid
        part = excess[crossing] / (excess[crossing] - excess[crossing + 1])
        solutions = [*start, *(A[crossing] + part * (A[crossing + 1] - A[crossing]))]
        rows += [(i, float(a), k) for k, a in enumerate(solutions)]
    step = np.array([row[0] for row in rows], np.int64)
    A = np.array([row[1] for row in rows])
    slope = _slope(law, f[step], A)
    spread = _relative_force_std(law, f[step], A) * F[step]
    with np.errstate(divide="ignore"):
        std = np.minimum(np.abs(spread / slope), A)
    phase = np.angle(modal_receptance(law, f[step], A))
    branch = np.array([row[2] for row in rows], np.int64)
    return ModalResponse(step, f[step], F[step], A, std, phase, branch, slope > 0)


def _force(law: ModalLaw, f: Array, A: Array, **change: float) -> Array:
    return A / ((2 * np.pi * f) ** 2 * np.abs(modal_receptance(law, f, A, **change)))


def _largest(law: ModalLaw, f: Array, F: Array) -> Array:
    """An amplitude above every solution: beyond the last knot the mode is linear."""
    last = law.amplitude_m_per_s2[-1]
    linear = (2 * np.pi * f) ** 2 * np.abs(modal_receptance(law, f, np.full(len(f), last))) * F
    return np.maximum(LIMITS.farthest_amplitude * last, 1.1 * linear)


def _slope(law: ModalLaw, f: Array, A: Array) -> Array:
    """Slope of the force over the amplitude, by a central difference narrow against the knots' spacing."""
    step = 1e-4 * A
    return (_force(law, f, A + step) - _force(law, f, A - step)) / (2 * step)


def _relative_force_std(law: ModalLaw, f: Array, A: Array) -> Array:
    """Of the force needed: from the frequency's and the damping's uncertainty, and the residual of the fits."""
    knots = np.array(law.amplitude_m_per_s2)
    a = np.clip(A, knots[0], knots[-1])

    def std(table: list[float], law: Array) -> Array:
        """Between knots; beyond them the law is held, and errs by what it would have gone on by."""
        slopes = np.diff(law) / np.diff(knots)
        return np.hypot(np.interp(a, knots, table), np.where(a > A, slopes[0], slopes[-1]) * (A - a))

    f_std = std(law.frequency_std_Hz, np.array(law.frequency_Hz))
    d_std = std(law.damping_relative_std, np.log(law.damping_ratio))
    small, base = 1e-4, _force(law, f, A)

    def by(name: str, at: float = 0.0) -> Array:
        up, down = (_force(law, f, A, **{name: at + change}) for change in (small, -small))
        return (up - down) / (2 * small * base)

    changes = by("shift_Hz") * f_std, by("damping_factor", 1.0) * d_std
    return np.sqrt(changes[0] ** 2 + changes[1] ** 2 + law.force_relative_std**2)
