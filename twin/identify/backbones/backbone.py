"""A measured mode's frequency and damping as smooth functions of amplitude, from response-controlled sweeps.

Holding the response makes each sweep a linear one, so every sweep gives a frequency and a damping of its own, with the
modal mass, a residual and a phase offset shared by all.  Smooth robust curves then join the sweeps; how well they
predict a sweep that was left out, and which sweeps no smooth curve predicts, is part of the result.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from twin.arrays import Array
from twin.identify.backbones.modal_prediction import predict_held
from twin.identify.backbones.robust_curve import RobustCurve, fit_robust_curve
from twin.identify.limits import LIMITS
from twin.rigs.modal import LevelFit, ModalLaw, ModalRig

KNOTS = 33
DAMPING_SCALE = 0.02


@dataclass(frozen=True)
class BackboneSweep:
    """One level: arrays of equal length, forces and accelerations peak values.

    The phase is the response's against the force in whatever convention the laboratory has (of displacement or
    acceleration, lag or lead); NaN throughout if it was not kept.
    """

    level: str
    frequency_Hz: Array
    force_N: Array
    acceleration_m_per_s2: Array
    phase_rad: Array

    @property
    def amplitude(self) -> float:
        """Median acceleration amplitude, m/s2."""
        return float(np.median(self.acceleration_m_per_s2))


@dataclass(frozen=True)
class _Fit:
    """Shared modal mass, residual and phase; frequency and damping by sweep; rms of the log-force by sweep."""

    mass: float
    residual: float
    phase: float
    frequency_Hz: Array
    damping: Array
    rms: Array


def identify_backbone(
    sweeps: Sequence[BackboneSweep], *, name: str, source: str = "", channel: str = "acc1"
) -> ModalRig:
    """Identify an amplitude-dependent mode.

    Parameters
    ----------
    sweeps
        At least four levels of response-controlled sweeps through the same resonance.
    name, source, channel
        Of the rig that is returned.

    Raises
    ------
    ValueError
        If there are fewer than four sweeps, or one has fewer than five steps.
    ArithmeticError
        If the fit to all sweeps does not settle.
    """
    if len(sweeps) < 4 or min(len(s.frequency_Hz) for s in sweeps) < 5:
        raise ValueError("an amplitude-dependent mode needs at least four sweeps of five steps each")
    fit = _fit_levels(sweeps)
    amplitude = np.array([s.amplitude for s in sweeps])
    frequency, damping = _curves(amplitude, fit)
    law = _law(fit, frequency, damping, amplitude)
    levels = []
    for k, sweep in enumerate(sweeps):
        rest = [s for i, s in enumerate(sweeps) if i != k]
        part = _fit_levels(rest)
        kept = np.delete(amplitude, k)
        others = _curves(kept, part)
        blind = _law(part, *others, amplitude)
        predicted = predict_held(blind, sweep.frequency_Hz, sweep.acceleration_m_per_s2).force_N
        error = float(fit.frequency_Hz[k] - others[0](amplitude[k]))
        spread = float(np.median(np.abs(frequency.left_out)) * 1.4826)
        levels.append(
            LevelFit(
                level=sweep.level,
                amplitude_m_per_s2=sweep.amplitude,
                frequency_Hz=float(fit.frequency_Hz[k]),
                damping_ratio=float(fit.damping[k]),
                left_out_frequency_error_Hz=error,
                left_out_force_rms=float(np.sqrt(np.mean((predicted / sweep.force_N - 1) ** 2))),
                shifted=0 < k < len(sweeps) - 1
                and abs(error) > LIMITS.backbone_shifted * max(spread, LIMITS.frequency_scale * fit.frequency_Hz[k]),
            )
        )
    return ModalRig(kind="modal", name=name, source=source, channel=channel, law=law, level=levels, note=_notes(levels))


def _fit_levels(sweeps: Sequence[BackboneSweep]) -> _Fit:
    """Least squares on the complex logarithm of the receptance, all sweeps together."""
    count = len(sweeps)
    phases = _displacement_phases(sweeps)
    measured = [
        s.acceleration_m_per_s2 / (2 * np.pi * s.frequency_Hz) ** 2 / s.force_N * np.exp(1j * np.nan_to_num(phase))
        for s, phase in zip(sweeps, phases, strict=True)
    ]
    with_phase = [bool(np.all(np.isfinite(phase))) for phase in phases]
    centre = np.array([s.frequency_Hz[np.argmin(s.force_N / s.acceleration_m_per_s2)] for s in sweeps])
    W0 = 2 * np.pi * float(np.median(centre))

    def model(theta: Array, k: int) -> Array:
        W = 2 * np.pi * centre[k] * (1 + theta[3 + k])
        zeta = np.exp(theta[3 + count + k])
        w = 2 * np.pi * sweeps[k].frequency_Hz
        mass = np.exp(theta[0])
        mode = 1 / (mass * (W**2 - w**2 + 2j * zeta * W**2))
        return np.asarray(np.exp(1j * theta[2]) * (mode + theta[1] / (mass * W0**2)))

    def residual(theta: Array) -> Array:
        logs = [np.log(model(theta, k) / measured[k]) for k in range(count)]
        angles = [part.imag for part, known in zip(logs, with_phase, strict=True) if known]
        return np.concatenate([*(part.real for part in logs), *angles, theta[2:3] / LIMITS.phase_offset])

    start = np.zeros(3 + 2 * count)
    for k, s in enumerate(sweeps):
        i = int(np.argmin(np.abs(s.frequency_Hz - centre[k])))
        away = int(np.argmax(np.abs(s.frequency_Hz - centre[k])))
        w, W = 2 * np.pi * s.frequency_Hz[away], 2 * np.pi * centre[k]
        mass = 1 / (np.abs(measured[k][away]) * abs(W**2 - w**2))
        start[0] += np.log(mass) / count
        start[3 + count + k] = np.log(1 / (2 * mass * W**2 * np.abs(measured[k][i])))
    scale = np.concatenate([[0.1, 1.0, 0.03], np.full(count, 1e-3), np.full(count, 0.1)])
    found = least_squares(residual, start, x_scale=scale)
    if not found.success:
        raise ArithmeticError(
            f"the sweeps' common fit did not settle in {found.nfev} trials, cost {found.cost:.3g}: {found.message}"
        )
    theta = found.x
    rms = [float(np.sqrt(np.mean(np.log(np.abs(model(theta, k) / measured[k])) ** 2))) for k in range(count)]
    return _Fit(
        mass=float(np.exp(theta[0])),
        residual=float(theta[1]),
        phase=float(theta[2]),
        frequency_Hz=centre * (1 + theta[3 : 3 + count]),
        damping=np.exp(theta[3 + count :]),
        rms=np.array(rms),
    )


def _displacement_phases(sweeps: Sequence[BackboneSweep]) -> list[Array]:
    """Phases turned so that the response lags the force by a quarter turn at resonance, later the higher the frequency.

    What is left, an offset of less than an eighth of a turn, is fitted.
    """
    falls, centre = [], []
    for s in sweeps:
        phase = np.unwrap(s.phase_rad)
        falls.append(phase[np.argmin(s.frequency_Hz)] - phase[np.argmax(s.frequency_Hz)])
        centre.append(phase[np.argmin(s.force_N / s.acceleration_m_per_s2)])
    known = [fall for fall in falls if np.isfinite(fall)]
    sign = -1.0 if known and np.median(known) < 0 else 1.0
    quarter = np.pi / 2
    return [
        sign * np.unwrap(s.phase_rad) - quarter * (np.round(sign * middle / quarter) + 1)
        for s, middle in zip(sweeps, centre, strict=True)
    ]


def _curves(amplitude: Array, fit: _Fit) -> tuple[RobustCurve, RobustCurve]:
    """Frequency (Hz) and damping ratio over the amplitude."""
    frequency = fit_robust_curve(
        amplitude, fit.frequency_Hz, scale=LIMITS.frequency_scale * float(fit.frequency_Hz.mean())
    )
    damping = fit_robust_curve(amplitude, fit.damping, scale=DAMPING_SCALE * float(np.median(fit.damping)))
    return frequency, damping


def _law(fit: _Fit, frequency: RobustCurve, damping: RobustCurve, amplitude: Array) -> ModalLaw:
    """Curves as knots over the range of `amplitude`, uncertain by curve and by stray of whole sweeps."""
    knots = np.linspace(float(amplitude.min()), float(amplitude.max()), KNOTS)
    stray_f = float(np.sqrt(np.mean(np.minimum(frequency.left_out**2, np.quantile(frequency.left_out**2, 0.9)))))
    stray_d = float(np.sqrt(np.mean((damping.left_out / fit.damping) ** 2)))
    zeta = np.maximum(damping(knots), 0.2 * fit.damping.min())
    return ModalLaw(
        modal_mass_kg=fit.mass,
        residual=fit.residual,
        phase_rad=fit.phase,
        amplitude_m_per_s2=knots.tolist(),
        frequency_Hz=frequency(knots).tolist(),
        damping_ratio=zeta.tolist(),
        frequency_std_Hz=(frequency.widened * np.hypot(frequency.std(knots), stray_f)).tolist(),
        damping_relative_std=(damping.widened * np.hypot(damping.std(knots) / zeta, stray_d)).tolist(),
        force_relative_std=float(np.sqrt(np.mean(fit.rms**2))),
    )


def _notes(levels: Sequence[LevelFit]) -> list[str]:
    """The left-out predictions of the levels between the lowest and the highest, in words."""
    inner = levels[1:-1]
    smooth = [level for level in inner if not level.shifted]
    notes = [
        f"sweep {level.level} at {level.amplitude_m_per_s2:.0f} m/s2: its resonance lies "
        f"{level.left_out_frequency_error_Hz:+.3f} Hz from the smooth law of all other sweeps; no smooth law of "
        "amplitude follows it, the structure itself was shifted"
        for level in inner
        if level.shifted
    ]
    for name, chosen in (("all interior levels", inner), ("interior levels that were not shifted", smooth)):
        if chosen:
            error = np.sqrt(np.mean([level.left_out_frequency_error_Hz**2 for level in chosen]))
            force = np.sqrt(np.mean([level.left_out_force_rms**2 for level in chosen]))
            notes.append(
                f"{name} ({len(chosen)}), each predicted from all other sweeps: frequency {error:.3f} Hz rms, "
                f"force {100 * force:.1f} % rms"
            )
    return notes
