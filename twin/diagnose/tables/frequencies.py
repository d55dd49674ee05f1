"""Diagnosis of measured natural frequencies against a nominal rig."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.diagnose.posterior import SURE
from twin.diagnose.result import Estimate, Misfit, NamedCause, Verdict, values_text
from twin.diagnose.tables.fit import SPREAD, Fit, Problem
from twin.diagnose.tables.lap_joint import LapJointFrequencies, require_one_joint
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.measured import Measurement, read_frequencies
from twin.diagnose.tables.model import FrequencyModel
from twin.diagnose.tables.nominal_masses import heavy_sensors
from twin.diagnose.tables.result import FrequencyRow, HeldOut, TableDiagnosis, Tried
from twin.diagnose.tables.search import (
    PLAUSIBLE,
    FrequencySearch,
    FrequencyStage,
    least_gain,
    probabilities,
    rivals_of,
    search,
)
from twin.diagnose.tables.single_beam import SingleBeamFrequencies
from twin.identify.rms import rms
from twin.rigs import Rig
from twin.rigs.beam import BeamRig

Array = NDArray[np.float64]
FEWEST = 3


def diagnose_frequencies(
    tables: Sequence[FrequencyTable],
    rig: Rig | BeamRig,
    *,
    preloads: Sequence[str] = (),
    held_out: Sequence[FrequencyTable] = (),
    source: str = "rig",
    most: int = 2,
    report: Callable[[str], None] = lambda text: None,
) -> TableDiagnosis:
    """Say what a rig's model gets wrong about measured natural frequencies.

    The moduli (E' and G' of a joint at each preload, Young's modulus of a beam alone) are always identified.  Every
    listed cause that frequencies can feel is then added in turn and refitted.

    Parameters
    ----------
    tables
        One or several preloads, at least three frequencies together.
    preloads
        Preload of the tables that do not say it themselves: one for all, or one each; the rig's first by default.
    held_out
        Frequencies kept for the gain, at preloads that `tables` hold.  Without any, each frequency is left out in turn.

    Raises
    ------
    InputError
        If the tables do not fit the rig or each other.
    """
    started = time.perf_counter()
    if isinstance(rig, BeamRig):
        if preloads:
            raise InputError("--preload", "", f"{source} is a beam alone and has no preloads", "leave it out")
        conditions: Sequence[str] = (rig.support,)
    else:
        require_one_joint(rig, source=source)
        conditions = rig.preloads
    measured = read_frequencies(tables, conditions, named=preloads, default=conditions[0], source=source)
    model: FrequencyModel
    if isinstance(rig, BeamRig):
        model = SingleBeamFrequencies(rig, source)
    else:
        model = LapJointFrequencies(rig, tuple(item.condition for item in measured), source)
    problem = Problem(model, tuple(measured))
    if problem.count < FEWEST:
        raise InputError(
            tables[0].path, "", f"holds {problem.count} natural frequencies", f"a diagnosis needs at least {FEWEST}"
        )
    check_modes(problem)
    kept = [
        item
        for table in held_out
        for item in read_frequencies(
            [table], [m.condition for m in measured], default=measured[0].condition, source="the RUNs"
        )
    ]
    found = search(problem, most=most, report=report)
    base, accepted = found.base, found.accepted
    final = accepted[-1].trials[0].fit if accepted else base
    verdict = _verdict(problem, base, final, accepted)
    after, errors = base, found.base_left_out
    if verdict in ("explained", "ambiguous"):
        assert accepted[-1].left_out is not None
        after, errors = final, accepted[-1].left_out
    left_out = found.base_left_out, errors
    causes = _causes(accepted, verdict)
    next_test = _next_mode(problem, accepted[-1]) if accepted and rivals_of(accepted[-1]) else ""
    return TableDiagnosis(
        kind="frequencies",
        rig=rig.name,
        runs=tuple(dict.fromkeys(Path(table.path).name for table in tables)),
        verdict=verdict,
        answer=_answer(verdict, causes, accepted),
        misfit=Misfit(
            chi2_per_dof=base.chi2_per_dof,
            after=after.chi2_per_dof,
            threshold=problem.threshold(after.dof),
            where=tuple(_where(problem, base)),
        ),
        causes=causes,
        gain=_gain(problem, kept, base, after, left_out),
        rows=tuple(_rows(problem, base, after, left_out)),
        tried=tuple(_tried(found)),
        parameters=_parameters(model, after),
        assumed=tuple(_assumed(problem)),
        notes=(*_notes(problem, after, found, next_test), *(heavy_sensors(problem, base) if verdict == "none" else ())),
        model=model.extended(
            {name: Estimate(value, after.moduli_std[name]) for name, value in after.moduli.items()},
            after.active,
            after.std,
        ),
        seconds=time.perf_counter() - started,
        next_test=next_test if verdict == "ambiguous" else "",
    )


def check_modes(problem: Problem) -> None:
    """Refuse modes that the mesh does not have.

    Raises
    ------
    InputError
        That names the mode.
    """
    elements = len(problem.model.matrices(()).M) // 6
    for item in problem.measured:
        if item.number[-1] > elements:
            reason = f"mode {item.number[-1]} is beyond the {elements} that this rig's mesh can show"
            raise InputError(item.path, "column mode", reason, "give it more elements, or leave the mode out")


def _verdict(problem: Problem, base: Fit, final: Fit, accepted: Sequence[FrequencyStage]) -> Verdict:
    if not accepted:
        return "none" if base.chi2_per_dof <= problem.threshold(base.dof) else "unknown"
    before, after = base.chi2_per_dof, final.chi2_per_dof
    if after > problem.threshold(final.dof) and after - 1 > 0.05 * (before - 1):
        return "unknown"
    last = accepted[-1]
    return "ambiguous" if probabilities(last)[0] < SURE and rivals_of(last) else "explained"


def _causes(accepted: Sequence[FrequencyStage], verdict: Verdict) -> tuple[NamedCause, ...]:
    """Causes in the model, then rivals."""
    found = []
    for number, stage in enumerate(accepted):
        best = stage.trials[0]
        final = accepted[-1].trials[0].fit  # the last fit has moved the earlier causes' values
        chance = probabilities(stage) * (0.3 if verdict == "unknown" else 1.0)
        found.append(_named(final, number, float(chance[0]), rivals_of(stage), verdict != "unknown"))
        for trial, probability in zip(stage.trials[1:], chance[1:], strict=True):
            if probability > 0.01 or trial.cause in rivals_of(stage):
                found.append(_named(trial.fit, number, float(probability), (best.cause,), False))
    return tuple(sorted(found, key=lambda cause: (-cause.probability, -cause.in_model)))


def _named(fit: Fit, number: int, probability: float, rivals: tuple[str, ...], in_model: bool) -> NamedCause:
    change, values = fit.active[number]
    parameters: dict[str, Estimate | str] = dict(change.label)
    parameters.update({name: Estimate(value, fit.std[number][name]) for name, value in values.items()})
    return NamedCause(
        cause=change.cause, summary=change.summary, probability=probability, confused_with=rivals,
        parameters=parameters, in_model=in_model,
    )  # fmt: skip


def _answer(verdict: Verdict, causes: Sequence[NamedCause], accepted: Sequence[FrequencyStage]) -> str:
    named = [cause for cause in causes if cause.in_model]
    what = "; ".join(f"{c.cause} ({values_text(c.parameters)}): {c.summary}" for c in named)
    if verdict == "none":
        return "With its moduli identified, the model agrees with the frequencies; nothing needs to be named."
    if verdict == "unknown":
        return "Something is missing from the model, and no cause that frequencies can show explains it."
    if verdict == "ambiguous":
        rivals = ", ".join(dict.fromkeys(rival for stage in accepted[-1:] for rival in rivals_of(stage)))
        return f"Most likely {what}; these frequencies cannot tell it from {rivals}."
    return f"The frequencies name {what}."


def _where(problem: Problem, base: Fit) -> list[dict[str, Any]]:
    """Shares of chi2 by mode, largest first."""
    shares = base.residual**2 / max(float(np.sum(base.residual**2)), 1e-300)
    labels = [
        {"run": Path(item.path).name, "channel": f"mode {mode}, {item.condition}", "harmonic": 1}
        for item in problem.measured
        for mode in item.number.tolist()
    ]
    return [{**labels[i], "share": float(shares[i])} for i in np.argsort(-shares)[:8]]


def _gain(
    problem: Problem, kept: Sequence[Measurement], base: Fit, after: Fit, left_out: tuple[Array, Array]
) -> HeldOut:
    if not kept:
        how = "each natural frequency in turn left out and predicted from all others"
        return HeldOut(rms(left_out[0]), rms(left_out[1]), _noise_floor(problem.measured, after), how=how)
    errors: list[list[Array]] = [[], []]
    for item in kept:
        for fit, column in zip((base, after), errors, strict=True):
            model = problem.frequencies(fit, {item.condition: item.number})[item.condition]
            column.append(item.frequency_Hz / model - 1)
    runs = tuple(dict.fromkeys(Path(item.path).name for item in kept))
    before, now = (rms(np.concatenate(column)) for column in errors)
    return HeldOut(before, now, _noise_floor(kept, after), how="natural frequencies of the held-out tables", runs=runs)


def _noise_floor(measured: Sequence[Measurement], after: Fit) -> float:
    """Rms relative deviation of the frequencies: as stated, else the one that the model makes most probable."""
    return rms(np.concatenate([item.relative_std * (1.0 if item.stated else after.scale) for item in measured]))


def _rows(problem: Problem, base: Fit, after: Fit, left_out: tuple[Array, Array]) -> list[FrequencyRow]:
    rows: list[FrequencyRow] = []
    for item in problem.measured:
        for i, (mode, measured) in enumerate(zip(item.number.tolist(), item.frequency_Hz.tolist(), strict=True)):
            k = len(rows)
            rows.append(
                FrequencyRow(
                    item.condition, mode, measured, float(base.frequency_Hz[item.condition][i]),
                    float(after.frequency_Hz[item.condition][i]), float(left_out[0][k]), float(left_out[1][k]),
                )
            )  # fmt: skip
    return rows


def _tried(found: FrequencySearch) -> list[Tried]:
    models = [("nothing", found.base, 0.0)]
    for stage in found.stages:
        before = [change.cause for change, _ in stage.before.active]
        models += [
            (" + ".join([*before, trial.cause]), trial.fit, trial.log_evidence - found.base.log_evidence)
            for trial in stage.trials
        ]
    rows = []
    for name, fit, gain in models:
        rows.append(Tried(name, gain, fit.chi2_per_dof, fit.rms_error))
    return sorted(rows, key=lambda row: -row.log_evidence)


def _parameters(model: FrequencyModel, fit: Fit) -> Mapping[str, tuple[float, Estimate]]:
    return {
        b.name: (b.nominal, Estimate(fit.moduli[b.name], fit.moduli_std[b.name]))
        for b in model.base
        if b.name in fit.moduli
    }


def _assumed(problem: Problem) -> list[str]:
    wide = sorted({b.log_std for b in problem.model.base})
    assumed = [f"The moduli are identified; before the data each is assumed to a factor of {np.exp(wide[-1]):.2g}."]
    if not problem.stated:
        assumed.append(
            f"The table gives no std_Hz: each frequency is taken to be good to {100 * LIMITS.assumed_std:g} %, a "
            f"figure that is itself right to within a factor of {np.exp(SPREAD):.0f}; all are off by the same factor, "
            "which the evidence integrates over."
        )
    rare = ", ".join(f"{cause} at {weight:g}" for cause, weight in PLAUSIBLE.items())
    assumed.append(
        "Nothing wrong is as probable beforehand as all causes together, and every cause as probable as any other, "
        f"except {rare} of them: damage is rarer than what models leave out."
    )
    assumed.append(
        "Not tried, since natural frequencies of small motion do not show them or this rig has no place for them: "
        + ", ".join(problem.model.silent)
        + "."
    )
    return assumed


def _notes(problem: Problem, after: Fit, found: FrequencySearch, next_test: str) -> list[str]:
    notes, accepted = [], found.accepted
    if not problem.stated:
        notes.append(
            f"std_Hz is not given: {100 * LIMITS.assumed_std:g} % is assumed, known to a factor of "
            f"{np.exp(SPREAD):.0f}; the model makes {100 * LIMITS.assumed_std * after.scale:.2g} % the most probable"
        )
    if after.active and after.dof < 1.5:
        notes.append(
            f"the frequencies leave {max(after.dof, 0):.1f} degrees of freedom: another measured mode would say "
            "much more"
        )
    for b in problem.model.base:
        if b.name in after.moduli:
            ratio = after.moduli[b.name] / b.nominal
            spread = after.moduli_std[b.name] / after.moduli[b.name]
            if abs(np.log(ratio)) > max(3 * spread, 0.1):
                notes.append(
                    f"{b.name} is identified as {after.moduli[b.name]:.3g} N/m2, {ratio:.2g} times what was assumed"
                )
    if accepted and rivals_of(accepted[-1]):
        notes += [note for note in (next_test, _without_prior(accepted[-1])) if note]
    if found.stages and not found.stages[-1].accepted:
        best = found.stages[-1].trials[0]
        gain = best.log_evidence - found.stages[-1].before.log_evidence
        beside = "as well " if accepted else ""
        asked = least_gain(problem, found.stages[-1].before)
        why = "" if gain < asked else ", and left-out frequencies would not be predicted better"
        notes.append(
            f"naming {best.cause} {beside}would change the log evidence by {gain:+.1f}, where {asked:+g} is asked{why}"
        )
    return notes


def _without_prior(stage: FrequencyStage) -> str:
    """Said where what is assumed of causes beforehand, and not the data, decides which comes first."""
    data = [trial.log_evidence - np.log(PLAUSIBLE.get(trial.cause, 1.0)) for trial in stage.trials]
    first = int(np.argmax(data))
    if first == 0:
        return ""
    return (
        f"the frequencies alone favour {stage.trials[first].cause} by {data[first] - data[0]:.1f} in log evidence; "
        "it comes later because damage is less probable beforehand"
    )


def _next_mode(problem: Problem, stage: FrequencyStage) -> str:
    """The unmeasured mode whose frequency tells the best cause from its nearest rival."""
    best = stage.trials[0]
    rival = next(trial for trial in stage.trials[1:] if trial.cause in rivals_of(stage))
    found: list[tuple[float, str]] = []
    for item in problem.measured:
        wanted = np.array([n for n in range(1, item.number[-1] + 3) if n not in item.number.tolist()])
        try:
            ours, theirs = (problem.frequencies(t.fit, {item.condition: wanted})[item.condition] for t in (best, rival))
        except (ValueError, np.linalg.LinAlgError):
            continue
        k = int(np.argmax(np.abs(np.log(ours / theirs))))
        text = (
            f"mode {wanted[k]} ({item.condition}) would tell them apart: {ours[k]:.5g} Hz by {best.cause}, "
            f"{theirs[k]:.5g} Hz by {rival.cause}"
        )
        found.append((float(abs(np.log(ours[k] / theirs[k]))), text))
    return max(found)[1] if found else ""
