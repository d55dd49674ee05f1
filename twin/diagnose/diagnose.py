"""Diagnosis from end to end: recordings and the nominal rig in, an answer out."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Run
from twin.diagnose.answer.comparison import SweepComparison, compare_sweeps
from twin.diagnose.answer.exclusion import Exclusion, exclusion_limits, hidden_at_limit
from twin.diagnose.answer.extended import updated_rig_file
from twin.diagnose.answer.gain import Gain, elsewhere, measure_gain
from twin.diagnose.answer.result import Diagnosis, Misfit
from twin.diagnose.effects import left_out_effects
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.diagnose.missing import find_missing_force
from twin.diagnose.model_evidence import unexplained
from twin.diagnose.models import CAUSES, DRIFTS
from twin.diagnose.next_test import plan_next_test
from twin.diagnose.options import DiagnosisOptions
from twin.diagnose.residual_columns import ResidualColumns
from twin.diagnose.selection.racing import THOROUGH, USUAL
from twin.diagnose.selection.search import Report, search_causes
from twin.diagnose.set_aside import set_aside
from twin.diagnose.signals import find_unsettled
from twin.diagnose.sound_data import SoundData, sound_data
from twin.diagnose.verdict import decide, named_causes, posterior_of, rivals_of
from twin.identify.measured_data import MeasuredData, common_preload
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up, time_limit
from twin.rigs import Rig, foreign_preload, save_rig
from twin.structure.plausibility import unlikely_units


@dataclass(frozen=True)
class HeldOutData:
    """What the gain is measured on."""

    evidence: MeasuredData | None = None
    runs: Sequence[Run] = ()
    """That it was reduced from; empty where steps of what was learnt from were set aside."""
    aside: tuple[str, ...] = ()
    """These, in words."""


@dataclass(frozen=True, kw_only=True)
class DiagnosedData:
    """What a diagnosis begins from."""

    sound: SoundData
    held_out: HeldOutData = HeldOutData()
    notes: tuple[str, ...]
    """What an engineer should know of the data beforehand."""
    unseeable: Sequence[Exclusion] = ()
    """Causes that such data cannot show at all."""
    begun: float
    """When its reduction was, by :func:`time.perf_counter`."""


def diagnose(
    runs: Sequence[Run],
    rig: Rig,
    *,
    preload: str | None = None,
    held_out: Sequence[Run] = (),
    source: str = "rig",
    out: Path | None = None,
    options: DiagnosisOptions | None = None,
    report: Report = lambda text: None,
) -> Diagnosis:
    """Say what a rig's model gets wrong about recordings: :func:`recordings_data`, then :func:`diagnose_data`."""
    asked = options or DiagnosisOptions()
    with asked.in_effect():
        data = recordings_data(runs, rig, preload=preload, held_out=held_out, source=source, report=report)
        return diagnose_data(data, out=out, options=asked, report=report)


def recordings_data(
    runs: Sequence[Run],
    rig: Rig,
    *,
    preload: str | None = None,
    held_out: Sequence[Run] = (),
    source: str = "rig",
    report: Report = lambda text: None,
) -> DiagnosedData:
    """Reduce recordings to what a diagnosis begins from.

    Parameters
    ----------
    runs
        Recordings to learn from: broadband runs, stepped sines, or both.
    rig
        What the experimenter believes.  Its effects, if it has any, act in every prediction; what is found is found
        beside them.
    preload
        State of the rig's joint; what the recordings name if not given.
    held_out
        Recordings kept for measuring the gain.  Without any, the middle one of three or more sweeps is set
        aside, or every fourth step of fewer.
    source
        Names the rig in errors.

    Raises
    ------
    InputError
        As :func:`~twin.diagnose.sound_data.sound_data`.
    """
    begun = time.perf_counter()
    asked_for = preload is not None
    preload = preload or common_preload([*runs, *held_out], rig)
    report("reducing recordings to harmonics and frequency responses")
    sound = sound_data(runs, rig, preload=preload, source=source)
    evidence, findings = sound.evidence, [*sound.findings]
    findings += find_unsettled([*evidence.steps.states, *evidence.unsettled], force=evidence.force)
    unseen: MeasuredData | None
    if held_out:
        # What drifts has gone on since the first run, not since the first that is held out.
        unseen = replace(sound_data(held_out, rig, preload=preload, source=source).evidence, begun_s=evidence.origin_s)
        aside: tuple[str, ...] = ()
    else:
        kept, unseen, aside = set_aside(evidence)
        evidence = kept
    notes = (*_notes(evidence), *notes_on(rig))
    if sound.sidebands is not None:
        notes = (sound.sidebands.told, *notes)
    if (foreign := foreign_preload(rig, runs[0].info)) and not asked_for:
        notes = (foreign, *notes)
    if unseen is None and len(evidence.steps):
        notes += ("too few steps to set any aside: the gain was not measured",)
    if unseen is not None and len(evidence.steps):
        unseen, beyond = _within_amplitudes(unseen, evidence)
        notes += beyond
    return DiagnosedData(
        sound=replace(sound, evidence=evidence, findings=tuple(findings)),
        held_out=HeldOutData(unseen, held_out, aside), notes=notes, begun=begun,
    )  # fmt: skip


def diagnose_data(
    data: DiagnosedData, *, out: Path | None, options: DiagnosisOptions, report: Report = lambda text: None
) -> Diagnosis:
    """Say what a rig's model gets wrong, from reduced data on.

    Parameters
    ----------
    out
        Folder for the extended model; none is written without it.
    options
        Its processes and its time limit are those of :meth:`DiagnosisOptions.in_effect`.
    """
    sound, held_out, notes, begun = data.sound, data.held_out, data.notes, data.begun
    evidence, findings, unseen = sound.evidence, [*sound.findings], held_out.evidence
    hidden = {one.cause for one in data.unseeable}
    causes = {name: cause for name, cause in options.causes.items() if name not in hidden}
    search = search_causes(evidence, causes, effort=THOROUGH if options.thorough else USUAL, report=report)
    if not search.complete:
        beside = f" beside {search.model.name}" if search.model.hypotheses else ""
        notes = (f"the time limit ended the search: what else there may be{beside} is not known", *notes)
    posterior = posterior_of(search, sound.sidebands)
    verdict = decide(posterior, findings)
    report("measuring the gain on what was held out")
    after = search.base if verdict in ("none", "unknown") else search.model
    gain: Gain | None = None
    compared: tuple[SweepComparison, ...] = ()
    if unseen is not None and len(unseen.steps):
        compared = compare_sweeps(unseen, elsewhere(search.base), elsewhere(after))
        runs = tuple(run.path for run in held_out.runs)
        learnt = (search.evidence, search.harmonics) if after is search.model else (evidence, search.base_harmonics)
        gain = measure_gain(learnt, unseen, search.base, after, runs=runs, sweeps=held_out.aside)
    extended, next_test = "", None
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        extended = "extended.toml"
        model = updated_rig_file(evidence, replace(search, model=after))
        save_rig(model, out / extended)
        rivals = rivals_of(posterior) if verdict == "ambiguous" else ()
        best = search.model if rivals else after
        asked = [name for name in options.exclude if name not in best.name.split(" + ")]
        largest = {name: hidden_at_limit(search.evidence, search.stages[-1].scores, name) for name in asked}
        rivals += tuple(_with_hidden(best, hidden) for hidden in largest.values() if hidden)
        notes += tuple(
            f"{name}: has no size that these data could limit, and no test is planned to exclude it"
            for name, hidden in largest.items()
            if not hidden
        )
        if evidence.runs and rivals and verdict != "unknown" and not time_is_up():
            with time_limit(time.monotonic() + time.perf_counter() - begun):  # as long again as the search took
                next_test = plan_next_test(evidence.runs, search.evidence, (best, *rivals), model, out, report=report)
    causes_named = named_causes(search, posterior, findings, verdict)
    acting = {cause.cause for cause in causes_named if cause.in_model} | {
        effect.cause for effect in evidence.rig.effect
    }
    if acting & set(DRIFTS) and _waits_left_out(evidence.runs):
        notes += ("the waits between steps were not stored: a drift's rate is per second of the recordings' own time",)
    left = still_left = _misfit(evidence, search.base, search.base_harmonics, search.stages[0].tolerances)
    if search.model is not search.base:
        still_left = _misfit(search.evidence, after, search.harmonics, search.stages[-1].tolerances)
    missing = find_missing_force(evidence, report=report) if verdict == "unknown" and not time_is_up() else None
    return Diagnosis(
        verdict=verdict,
        misfit=Misfit(
            chi2_per_dof=sum(left.values()) / max(1, search.base.dof),
            after=sum(still_left.values()) / max(1, after.dof),
            threshold=LIMITS.diagnose_threshold,
            where=_where(left),
        ),
        causes=causes_named,
        gain=gain,
        next_test=next_test,
        seconds=time.perf_counter() - begun,
        evidence=search.evidence,
        search=search,
        sweeps=compare_sweeps(evidence, search.base, after) if len(evidence.steps) else (),
        held_out=compared,
        notes=notes,
        extended_model=extended,
        missing_force=missing,
        set_95=posterior.set_95,
        hypotheses=posterior.weighed,
        excluded=(*exclusion_limits(search.evidence, search.stages[-1].scores), *data.unseeable),
        files=(*evidence.sources, *(run.path for run in held_out.runs)),
    )


def _with_hidden(model: FittedModel, hidden: CauseHypothesis) -> FittedModel:
    """The model with a cause as large as it could be without having been seen."""
    less_likely = model.log_evidence - LIMITS.exclusion_limit_95**2 / 2
    return replace(model, hypotheses=(*model.hypotheses, hidden), log_evidence=less_likely)


def _within_amplitudes(unseen: MeasuredData, evidence: MeasuredData) -> tuple[MeasuredData, tuple[str, ...]]:
    """What was held out, without steps at amplitudes beyond those learnt from: the joint's law is not known there."""
    inside = unseen.steps.amplitude_m <= LIMITS.diagnose_beyond * np.max(evidence.steps.amplitude_m)
    if inside.all():
        return unseen, ()
    note = f"{np.sum(~inside)} held-out step(s) move farther than any step learnt from, and do not count in the gain"
    return replace(unseen, steps=unseen.steps.select(inside)), (note,)


def _misfit(
    evidence: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals | None, tolerances: ResidualColumns
) -> dict[tuple[str, str, int], float]:
    """What a model leaves of chi2, by run, channel and harmonic, where it may be wrong as a sound rig's only."""
    blocks, left = unexplained(evidence, harmonics, model, tolerances)
    outputs = len(evidence.channels)
    shares: dict[tuple[str, str, int], float] = {}

    def add(run: str, harmonic: int, values: NDArray[Any]) -> None:
        for channel, value in zip(evidence.channels, values, strict=True):
            name = (Path(run).name, channel, harmonic)
            shares[name] = shares.get(name, 0.0) + float(value)

    for name, block in blocks:
        square = left[block] ** 2
        if name.startswith("broadband"):
            add(evidence.broadband[int(name.split()[1])].run, 1, square.reshape(2, -1, outputs).sum(axis=(0, 1)))
        elif name == "steps":
            for state, row in zip(evidence.steps.states, square.reshape(-1, 2, outputs).sum(axis=1), strict=True):
                add(state.run, 1, row)
        elif harmonics is not None:
            per = square.reshape(2, len(evidence.steps), -1, outputs).sum(axis=0)
            for state, table in zip(evidence.steps.states, per, strict=True):
                for order, row in zip(harmonics.orders, table, strict=True):
                    add(state.run, int(order), row)
    return shares


def _where(left: dict[tuple[str, str, int], float]) -> tuple[dict[str, Any], ...]:
    """The largest shares of chi2."""
    total = sum(left.values()) or 1.0
    ranked = sorted(left.items(), key=lambda item: -item[1])[:8]
    return tuple(
        {"run": run, "channel": channel, "harmonic": harmonic, "share": value / total}
        for (run, channel, harmonic), value in ranked
    )


def _waits_left_out(runs: Sequence[Run]) -> bool:
    return any(run.info.get("stored") == "settled" and any(step.frequency_Hz for step in run.steps) for run in runs)


def _notes(evidence: MeasuredData) -> tuple[str, ...]:
    """What an engineer should know of the data before reading the answer."""
    notes = []
    if evidence.unsettled:
        where = ", ".join(f"{s.sweep} at {s.frequency_Hz:g} Hz" for s in evidence.unsettled[:6])
        notes.append(f"{len(evidence.unsettled)} step(s) were still changing and were left out: {where}")
    if evidence.dropped:
        notes.append(f"{evidence.dropped} step(s) lack too many sound samples of a channel and were left out")
    notes += evidence.unused_told
    lost = sum(state.lost for state in evidence.steps.states)
    if lost:
        notes.append(f"{lost} samples are missing in the measured steps")
    if not evidence.broadband:
        notes.append("no broadband run: E', G' and causes away from the first mode are weakly determined")
    if evidence.rig.joints and not len(evidence.steps):
        notes.append("no stepped sines: the joint's nonlinear law cannot be seen")
    return tuple(notes)


def notes_on(rig: Rig) -> tuple[str, ...]:
    """What of the rig file the predictions have, and what they have not."""
    known = [effect.cause for effect in rig.effect if effect.cause in CAUSES]
    notes = [f"the rig file's effects act already, and any cause is beside them: {', '.join(known)}"] if known else []
    notes += left_out_effects(rig.effect)
    notes += [f"implausible: {line}" for line in unlikely_units(rig)]
    if rig.drift.temperature_K_per_h or rig.drift.preload_loss_per_h:
        notes.append("the rig file's drift is left out: a drift is found whole")
    leaning = [sensor.channel for sensor in rig.response_sensors if sensor.transverse_sensitivity]
    if leaning:
        notes.append(f"the transverse sensitivity of {', '.join(leaning)} is left out")
    return tuple(notes)
