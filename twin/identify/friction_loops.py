"""A friction joint's law from measured loops of force over displacement, at several clamp tensions.

Three laws compete: Jenkins (a spring and a slider), Iwan (many in parallel, their slip forces spread evenly) and
Jenkins behind a backlash.  Stiffness, backlash and spread are shared by all tensions, only the slip forces change.
Loops are compared below `cutoff_Hz`: what a slow drive excites above it is ringing of the frame, not the joint's law.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import constants
from scipy.optimize import least_squares
from scipy.signal import butter, sosfiltfilt

from recordings.errors import InputError, reason_of
from twin.arrays import Array

INCH, KIP = constants.inch, 1e3 * constants.pound_force
SIZE_LIMIT_BYTES = 64 << 20
SLIDERS = 24
SETTLE_PERIODS = 1.0


@dataclass(frozen=True)
class Loop:
    """One test: displacement (m) and force (N) at equal time steps, under a name such as its tension."""

    name: str
    sample_rate: float
    displacement_m: Array
    force_N: Array


@dataclass(frozen=True)
class FrictionFit:
    """One law fitted to all loops."""

    law: str
    """``jenkins``, ``iwan`` or ``jenkins-with-gap``."""
    shared: dict[str, float]
    shared_std: dict[str, float]
    """``stiffness_N_per_m``, and ``gap_m`` or ``spread`` where the law has one."""
    slip_force_N: dict[str, tuple[float, float]]
    """By loop, (in the positive, in the negative direction)."""
    slip_force_std_N: dict[str, tuple[float, float]]
    r2: dict[str, float]
    r2_unfiltered: dict[str, float]
    """Coefficient of determination by loop, below the cutoff and of the signal as it was measured."""
    bic: float
    """Bayesian information criterion; lower is better supported."""


@dataclass(frozen=True)
class FrictionIdentification:
    """All laws, the best supported first.

    `left_out_r2` is the best law's on each loop, with the shared parameters taken from the other loops.
    """

    fits: tuple[FrictionFit, ...]
    left_out_r2: dict[str, float]

    @property
    def best(self) -> FrictionFit:
        """The best supported law."""
        return self.fits[0]


def read_damper_json(path: Path) -> Loop:
    """A loop of the ARTS laboratory's friction damper: rows of time, inches, kip, ..., at `sampling freq`.

    InputError if the file is not such a table.
    """
    try:
        if path.stat().st_size > SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes")
        table = json.loads(path.read_text(encoding="utf-8"))
        rows = np.array(table["data"], float)
        rate = float(table["sampling freq"])
    except OSError as error:
        raise InputError(path, "", reason_of(error)) from error
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(path, "data", f"not a friction-damper table: {error}") from error
    if rows.ndim != 2 or rows.shape[1] < 3 or len(rows) < 100 or not np.all(np.isfinite(rows)) or not rate > 0:
        raise InputError(path, "data", "needs at least 100 finite rows of time, displacement and force")
    return Loop(path.stem, rate, INCH * rows[:, 1], KIP * rows[:, 2])


def identify_friction(loops: Sequence[Loop], *, cutoff_Hz: float = 10.0) -> FrictionIdentification:
    """Choose a law by evidence and identify it on all loops together.

    Parameters
    ----------
    loops
        Tests that differ in tension only.
    cutoff_Hz
        Model and measurement are both compared below it (zero-phase filter).
    """
    fits = sorted((_fit(name, loops, cutoff_Hz) for name in LAWS), key=lambda fit: fit.bic)
    left_out = {}
    if len(loops) > 1:
        for loop in loops:
            rest = _fit(fits[0].law, [other for other in loops if other is not loop], cutoff_Hz)
            left_out[loop.name] = _fit(fits[0].law, [loop], cutoff_Hz, held=rest.shared).r2[loop.name]
    return FrictionIdentification(tuple(fits), left_out)


def jenkins(x: Array, shared: Array, up: float, down: float) -> Array:
    """Spring and slider; `shared` is (stiffness,), or (stiffness, gap) behind a backlash.

    The slider keeps the link's extension between the two at which it slips; within the gap there is no force.
    """
    stiffness, gap = float(shared[0]), float(np.sum(shared[1:]))
    high, low = gap / 2 + up / stiffness, -gap / 2 - down / stiffness
    slider = 0.0
    extension = np.zeros(len(x))
    for i, value in enumerate(x.tolist()):
        slider = min(max(slider, value - high), value - low)
        extension[i] = value - slider
    return np.asarray(stiffness * (np.maximum(extension - gap / 2, 0) + np.minimum(extension + gap / 2, 0)))


def iwan(x: Array, shared: Array, up: float, down: float) -> Array:
    """Parallel sliders of equal stiffness, slip forces even between (1 - spread) and (1 + spread) times the mean.

    `shared` is (stiffness, spread), the spread between 0 and 1.
    """
    share = 1 + float(shared[1]) * np.linspace(-1, 1, SLIDERS)
    high, low = up * share / shared[0], -down * share / shared[0]
    slider = np.zeros(SLIDERS)
    force = np.zeros(len(x))
    for i, value in enumerate(x):
        slider = np.minimum(np.maximum(slider, value - high), value - low)
        force[i] = np.mean(value - slider)
    return float(shared[0]) * force


Law = Callable[[Array, Array, float, float], Array]
LAWS: dict[str, tuple[Law, tuple[str, ...]]] = {
    "jenkins": (jenkins, ("stiffness_N_per_m",)),
    "iwan": (iwan, ("stiffness_N_per_m", "spread")),
    "jenkins-with-gap": (jenkins, ("stiffness_N_per_m", "gap_m")),
}


def _fit(name: str, loops: Sequence[Loop], cutoff_Hz: float, *, held: dict[str, float] | None = None) -> FrictionFit:
    law, shared_names = LAWS[name]
    free_names = () if held else shared_names
    filters = [butter(3, cutoff_Hz / (loop.sample_rate / 2), output="sos") for loop in loops]
    measured = [sosfiltfilt(sos, loop.force_N) for sos, loop in zip(filters, loops, strict=True)]
    settled = [slice(int(SETTLE_PERIODS * loop.sample_rate), None) for loop in loops]
    kept = [force[part] for force, part in zip(measured, settled, strict=True)]

    def shared_of(theta: Array) -> Array:
        return np.array([held[n] for n in shared_names]) if held else np.exp(theta[: len(shared_names)])

    def forces(theta: Array) -> list[Array]:
        slips = np.exp(theta[len(free_names) :]).reshape(-1, 2)
        return [
            law(loop.displacement_m, shared_of(theta), *slip) for loop, slip in zip(loops, slips.tolist(), strict=True)
        ]

    def residuals(theta: Array) -> list[Array]:
        return [
            (sosfiltfilt(sos, force)[part] - target) / target.std()
            for sos, force, part, target in zip(filters, forces(theta), settled, kept, strict=True)
        ]

    start = _start(name, loops, kept, len(free_names) > 0)
    upper = np.full(len(start), np.inf)
    if "spread" in free_names:
        upper[free_names.index("spread")] = 0.0  # sliders that slip at a negative force are none
    found = least_squares(
        lambda theta: np.concatenate(residuals(theta)), start, bounds=(-np.inf, upper), diff_step=1e-4, x_scale=0.1
    )
    # Below the cutoff there are two independent values a period of it, not one a sample.
    independent = sum(2 * cutoff_Hz * len(f) / loop.sample_rate for f, loop in zip(kept, loops, strict=True))
    mean_square = float(np.mean(found.fun**2))
    free = len(found.x)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * mean_square * len(found.fun) / max(independent - free, 1)
    log_std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    slips = np.exp(found.x[len(free_names) :]).reshape(-1, 2)
    slip_std = slips * log_std[len(free_names) :].reshape(-1, 2)
    shared = dict(zip(shared_names, shared_of(found.x).tolist(), strict=True))
    parts = residuals(found.x)
    raw = forces(found.x)
    return FrictionFit(
        law=name,
        shared=shared,
        shared_std={n: shared[n] * float(s) for n, s in zip(free_names, log_std, strict=False)},
        slip_force_N={loop.name: (float(a), float(b)) for loop, (a, b) in zip(loops, slips, strict=True)},
        slip_force_std_N={loop.name: (float(a), float(b)) for loop, (a, b) in zip(loops, slip_std, strict=True)},
        r2={loop.name: 1 - float(np.mean(part**2)) for loop, part in zip(loops, parts, strict=True)},
        r2_unfiltered={
            loop.name: 1 - float(np.mean((f - loop.force_N)[part] ** 2) / np.var(loop.force_N[part]))
            for loop, f, part in zip(loops, raw, settled, strict=True)
        },
        bic=float(independent * np.log(mean_square) + free * np.log(independent)),
    )


def _start(name: str, loops: Sequence[Loop], forces: Sequence[Array], with_shared: bool) -> Array:
    """Slip forces from the forces' upper and lower plateaus; stiffness and gap from a tenth of the stroke."""
    slips = [[max(np.quantile(f, 0.8), 1e-3), max(-np.quantile(f, 0.2), 1e-3)] for f in forces]
    stroke = max(float(np.ptp(loop.displacement_m)) for loop in loops)
    shared = [np.log(np.max(slips) / (0.05 * stroke))]
    shared += {"jenkins": [], "iwan": [np.log(0.5)], "jenkins-with-gap": [np.log(0.1 * stroke)]}[name]
    return np.concatenate([shared if with_shared else [], np.log(np.ravel(slips))])
