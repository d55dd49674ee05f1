"""Diagnosis of response-controlled sweeps: what a smooth law of amplitude leaves unexplained.

No finite elements: each sweep holds its response and so is a linear mode; a smooth law joins their frequencies and
dampings, and every sweep is predicted from all others.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2 as chi_square

from recordings.errors import InputError, blamed_on
from twin.arrays import Array
from twin.diagnose.answer.result import Estimate, Misfit, NamedCause, Verdict
from twin.diagnose.models import CAUSES
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.order_in_time import FrequencyDrift, Jump, find_drift, find_jump
from twin.diagnose.tables.result import HeldOutValues, SweepRow, TableDiagnosis
from twin.identify.backbones.backbone import BackboneSweep, identify_backbone
from twin.identify.backbones.modal_prediction import predict_held
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.rms import rms
from twin.rigs.modal import LevelFit, ModalLaw


def diagnose_sweeps(
    sweeps: Sequence[BackboneSweep],
    *,
    path: str | Path,
    rig_name: str,
    held_out: Sequence[BackboneSweep] = (),
    held_out_paths: Sequence[str | Path] = (),
    channel: str = "acc1",
    source: str = "",
) -> TableDiagnosis:
    """Say what no smooth law of amplitude explains.

    Parameters
    ----------
    sweeps
        In the order in which they were run; at least five with five steps each.
    held_out
        Sweeps kept for the gain; without any, each is left out in turn.
    rig_name, channel, source
        Of the modal model that is identified.

    Raises
    ------
    InputError
        If the sweeps are too few, too many, or did not hold their response, or no model fits them.
    """
    started = time.perf_counter()
    _check(sweeps, path)
    by_amplitude = sorted(range(len(sweeps)), key=lambda k: sweeps[k].amplitude)
    with blamed_on(path, of=ArithmeticError):
        model = identify_backbone([sweeps[k] for k in by_amplitude], name=rig_name, source=source, channel=channel)
    assert model.law is not None
    levels = [model.level[by_amplitude.index(k)] for k in range(len(sweeps))]
    rows = [
        _row(k, sweep, level, model.law, by_amplitude)
        for k, (sweep, level) in enumerate(zip(sweeps, levels, strict=True))
    ]
    inner = [row for row in rows if row.inside]
    scale = IDENTIFY.frequency_scale * float(np.mean([row.frequency_Hz for row in rows]))
    drift = find_drift(rows, scale)
    errors = np.array([row.shift_Hz for row in inner])
    quiet = np.array([row.shift_Hz for row in inner if not row.shifted])
    chi2 = float(np.mean((errors / scale) ** 2))
    threshold = float(chi_square.isf(0.01, len(inner)) / len(inner))
    jump = find_jump(rows, scale)
    paid = drift is not None and drift.pays and rms(drift.left_out) <= jump.left_out
    verdict: Verdict = "none" if chi2 <= threshold else "unknown"
    causes: tuple[NamedCause, ...] = ()
    if paid and drift is not None:
        causes = _causes(drift)
        verdict = "ambiguous" if len(causes) > 1 else "explained"
    after_chi2 = float(np.mean((drift.left_out[[row.inside for row in rows]] / scale) ** 2)) if paid and drift else chi2
    if held_out:
        gain = _on_held_out(held_out, held_out_paths, model.law)
    else:
        gain = _gain(sweeps, rows, model.law, drift if paid else None)
    return TableDiagnosis(
        kind="sweeps",
        rig=rig_name,
        runs=(Path(path).name,),
        verdict=verdict,
        answer=_answer(verdict, inner, causes, jump),
        misfit=Misfit(chi2_per_dof=chi2, after=after_chi2, threshold=threshold, where=tuple(_where(inner, path))),
        causes=causes,
        gain=gain,
        rows=tuple(rows),
        tried=(),
        parameters={
            f"frequency_at_{which}_amplitude_Hz": (
                float("nan"), Estimate(model.law.frequency_Hz[k], model.law.frequency_std_Hz[k])
            )
            for which, k in (("smallest", 0), ("largest", -1))
        },
        assumed=(
            f"A sweep's resonance repeats to {100 * IDENTIFY.frequency_scale:g} % ({1e3 * scale:.0f} mHz), what a "
            "bolted beam reaches without being taken apart; the misfit is in units of it.",
            "Sweeps were run in the order of the file.  The table has no time, so a drift can be stated per sweep "
            "only.",
            "Of the rig its name and the channel's are taken: a table of one mode needs no mesh.",
        ),
        notes=tuple(_notes(sweeps, rows, model.law, drift, jump, quiet, scale)),
        model=model,
        seconds=time.perf_counter() - started,
    )  # fmt: skip


def _check(sweeps: Sequence[BackboneSweep], path: str | Path) -> None:
    steps = sum(len(sweep.frequency_Hz) for sweep in sweeps)
    if len(sweeps) < 5 or min(len(sweep.frequency_Hz) for sweep in sweeps) < 5:
        raise InputError(path, "", f"holds {len(sweeps)} sweeps", "a diagnosis needs at least five of five steps each")
    if steps > LIMITS.most_steps or len(sweeps) > LIMITS.most_sweeps:
        raise InputError(
            path,
            "",
            f"holds {steps} steps in {len(sweeps)} sweeps",
            f"give at most {LIMITS.most_steps} steps in {LIMITS.most_sweeps} sweeps",
        )
    for sweep in sweeps:
        a = sweep.acceleration_m_per_s2
        if np.max(np.abs(a / sweep.amplitude - 1)) > LIMITS.sweeps_held:
            raise InputError(
                path, f"sweep {sweep.level}", f"its acceleration ranges from {a.min():.4g} to {a.max():.4g} m/s2",
                "give sweeps that hold the response; twin predict compares force-controlled ones with a model of those",
            )  # fmt: skip


def _row(k: int, sweep: BackboneSweep, level: LevelFit, law: ModalLaw, by_amplitude: Sequence[int]) -> SweepRow:
    return SweepRow(
        sweep=sweep.level,
        order=k + 1,
        amplitude_m_per_s2=level.amplitude_m_per_s2,
        frequency_Hz=level.frequency_Hz,
        damping_ratio=level.damping_ratio,
        shift_Hz=level.left_out_frequency_error_Hz,
        force_error=level.left_out_force_rms,
        own_error=rms(_force_error(sweep, law, level.frequency_Hz, level.damping_ratio)),
        shifted=level.shifted,
        inside=by_amplitude.index(k) not in (0, len(by_amplitude) - 1),
    )


def _force_error(sweep: BackboneSweep, law: ModalLaw, frequency_Hz: float, damping: float) -> Array:
    """Relative error of the force by a linear mode."""
    knots = len(law.amplitude_m_per_s2)
    own = law.model_copy(update={"frequency_Hz": [frequency_Hz] * knots, "damping_ratio": [damping] * knots})
    return _error_of_law(sweep, own)


def _error_of_law(sweep: BackboneSweep, law: ModalLaw) -> Array:
    """Relative error of the force by a law."""
    return np.asarray(predict_held(law, sweep.frequency_Hz, sweep.acceleration_m_per_s2).force_N / sweep.force_N - 1)


def _causes(drift: FrequencyDrift) -> tuple[NamedCause, ...]:
    """A drift's names: a loose bolt and a warming beam look alike in one mode; only the latter also goes up."""
    names = ["preload-loss", "temperature-drift"] if drift.rate_Hz.value < 0 else ["temperature-drift"]
    return tuple(
        NamedCause(
            cause=name,
            summary=CAUSES[name].summary,
            probability=0.99 / len(names),
            confused_with=tuple(other for other in names if other != name),
            parameters={"shift_Hz_per_sweep": drift.rate_Hz},
            in_model=i == 0,
        )
        for i, name in enumerate(names)
    )


def _answer(verdict: Verdict, inner: Sequence[SweepRow], causes: Sequence[NamedCause], jump: Jump) -> str:
    own, force = (rms(np.array([getattr(row, name) for row in inner])) for name in ("own_error", "force_error"))
    figures = (
        f"the smooth law of all other sweeps predicts a sweep's force to {100 * force:.1f} % rms, "
        f"a linear mode of its own to {100 * own:.1f} %"
    )
    if verdict == "none":
        return f"A smooth law of amplitude explains every sweep: {figures}."
    if causes:
        rate = causes[0].parameters["shift_Hz_per_sweep"]
        assert isinstance(rate, Estimate)
        names = " or ".join(cause.cause for cause in causes)
        return f"The resonance moves by {rate:+} Hz from sweep to sweep beside the law: {names}; {figures}."
    if jump.clear:
        return (
            f"The resonance jumps by {jump.size_Hz:+} Hz before sweep {jump.before} and stays "
            f"there, which no listed cause does; {figures}."
        )
    shifted = [row for row in inner if row.shifted]
    if shifted:
        which = ", ".join(f"{row.sweep} ({row.amplitude_m_per_s2:.0f} m/s2, {row.shift_Hz:+.3f} Hz)" for row in shifted)
        return (
            f"No smooth law of amplitude explains every sweep: the resonance of sweep {which} is shifted as a whole, "
            f"which no listed cause does to single sweeps; {figures}."
        )
    return f"A smooth law of amplitude leaves more than sweeps scatter, and no listed cause explains it: {figures}."


def _where(inner: Sequence[SweepRow], path: str | Path) -> list[dict[str, Any]]:
    """Shares of the misfit by sweep, largest first."""
    total = max(sum(row.shift_Hz**2 for row in inner), 1e-300)
    ranked = sorted(inner, key=lambda row: -abs(row.shift_Hz))
    return [
        {
            "run": Path(path).name,
            "channel": "force",
            "harmonic": 1,
            "sweep": row.sweep,
            "share": row.shift_Hz**2 / total,
        }
        for row in ranked
    ]


def _gain(
    sweeps: Sequence[BackboneSweep], rows: Sequence[SweepRow], law: ModalLaw, drift: FrequencyDrift | None
) -> HeldOutValues:
    """Errors of the force over sweeps between the lowest and the highest, each predicted from all others."""
    inner = [row for row in rows if row.inside]
    floor = rms(np.array([row.own_error for row in inner]))
    how = "each sweep between the lowest and the highest in turn left out and predicted from all others"
    names = tuple(row.sweep for row in inner)
    before = after = rms(np.array([row.force_error for row in inner]))
    if drift is not None:
        columns: list[list[float]] = [[], []]
        for sweep, row in zip(sweeps, rows, strict=True):
            if row.inside:
                for errors, column in zip((drift.without, drift.left_out), columns, strict=True):
                    column.append(_moved_alone(sweep, row, law, row.frequency_Hz - float(errors[row.order - 1])))
        before, after = (rms(np.array(column)) for column in columns)
    return HeldOutValues.of(before, after, floor, how=how, sweeps=names)


def _on_held_out(sweeps: Sequence[BackboneSweep], paths: Sequence[str | Path], law: ModalLaw) -> HeldOutValues:
    """Errors of the force by the law of all sweeps; a drift cannot be applied to sweeps of another table."""
    error = rms(np.concatenate([_error_of_law(sweep, law) for sweep in sweeps]))
    names = tuple(sweep.level for sweep in sweeps)
    runs, how = tuple(Path(path).name for path in paths), "sweeps of the held-out tables"
    return HeldOutValues.of(error, error, law.force_relative_std, how=how, runs=runs, sweeps=names)


def _notes(
    sweeps: Sequence[BackboneSweep],
    rows: Sequence[SweepRow],
    law: ModalLaw,
    drift: FrequencyDrift | None,
    jump: Jump,
    quiet: Array,
    scale: float,
) -> list[str]:
    notes = [
        f"sweep {row.sweep} at {row.amplitude_m_per_s2:.0f} m/s2 lies {row.shift_Hz:+.3f} Hz "
        f"({abs(row.shift_Hz) / scale:.0f} times the scatter expected) from the law of all others; its force is "
        f"predicted to {100 * row.force_error:.1f} %, to "
        f"{100 * _moved_alone(sweep, row, law, row.frequency_Hz):.1f} % once its "
        f"resonance alone is moved, to {100 * row.own_error:.1f} % by a mode of its own"
        for sweep, row in zip(sweeps, rows, strict=True)
        if row.shifted
    ]
    if len(quiet):
        notes.append(
            f"the {len(quiet)} other sweeps between the lowest and the highest stray by {rms(quiet):.3f} Hz rms from "
            "the law of all others"
        )
    notes.append(_by_range(sweeps, rows, law))
    notes.append(_jump_note(jump))
    if drift is None:
        notes.append(
            "the sweeps were run in order of their amplitude: a drift in time and a law of amplitude cannot be told "
            "apart; repeat one level at the end"
        )
    else:
        notes.append(
            f"a drift of {drift.rate_Hz:+} Hz per sweep beside the law takes left-out errors "
            f"from {rms(drift.without):.3f} to {rms(drift.left_out):.3f} Hz rms"
        )
    return [note for note in notes if note]


def _moved_alone(sweep: BackboneSweep, row: SweepRow, law: ModalLaw, frequency_Hz: float) -> float:
    """Error of the force with another resonance and the law's damping."""
    damping = float(np.interp(row.amplitude_m_per_s2, law.amplitude_m_per_s2, law.damping_ratio))
    return rms(_force_error(sweep, law, frequency_Hz, damping))


def _by_range(sweeps: Sequence[BackboneSweep], rows: Sequence[SweepRow], law: ModalLaw) -> str:
    """Errors of the law fitted to all sweeps, by range of frequency about each sweep's resonance."""
    parts: dict[str, list[Array]] = {"below": [], "at": [], "above": []}
    for sweep, row in zip(sweeps, rows, strict=True):
        error = _error_of_law(sweep, law)
        away = (sweep.frequency_Hz / row.frequency_Hz - 1) / row.damping_ratio
        for name, here in (("below", away < -1), ("at", np.abs(away) <= 1), ("above", away > 1)):
            parts[name].append(error[here])
    told = [
        f"{name} resonance {100 * rms(np.concatenate(errors)):.1f} % ({sum(map(len, errors))} steps)"
        for name, errors in parts.items()
        if sum(map(len, errors))
    ]
    return "rms error of the force by the law fitted to all sweeps: " + ", ".join(told)


def _jump_note(jump: Jump) -> str:
    """What the best jump does, in words."""
    errors = f"takes left-out errors from {jump.without:.3f} to {jump.left_out:.3f} Hz rms"
    if not jump.clear:
        return f"a single lasting jump does not explain it: the best, before sweep {jump.before}, {errors}"
    return (
        f"a lasting jump of {jump.size_Hz:+} Hz before sweep {jump.before} {errors}: the joint may have slipped there"
    )
