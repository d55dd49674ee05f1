"""Diagnosis of measured natural frequencies: the selection of :mod:`twin.diagnose.selection` on tables of them."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2 as chi_square

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.arrays import Array
from twin.diagnose.answer.exclusion import exclusion_limits
from twin.diagnose.answer.extended import effects_of
from twin.diagnose.answer.parameter_text import parameters_text
from twin.diagnose.answer.result import IN_WORDS, Estimate, Misfit, NamedCause, Verdict
from twin.diagnose.cause import Cause
from twin.diagnose.effects import with_effects
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.model_evidence import fit_with_errors, unexplained
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE, RARER_IN_FREQUENCIES, least_gain, log_weight
from twin.diagnose.selection.racing import WHATEVER
from twin.diagnose.selection.search import Search, search_causes
from twin.diagnose.tables.felt import felt_causes
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.result import FrequencyRow, HeldOutValues, TableDiagnosis, Tried
from twin.diagnose.verdict import Posterior, decide, named_causes, posterior_of
from twin.identify.base_fit import fit_base
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.residuals.error_model import SPREAD
from twin.identify.residuals.frequency_model import FrequencyModel, check_modes, sound_errors
from twin.identify.residuals.natural_frequencies import (
    MeasuredFrequencies,
    StateFrequencies,
    measured_frequencies,
    sort_by_state,
)
from twin.identify.rms import rms
from twin.rigs import BeamPart, Rig
from twin.rigs.beam import BeamRig


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

    The moduli (E' and G' of every joint at each preload, Young's of a structure without joints) are always identified.

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
    structure = rig.structure() if isinstance(rig, BeamRig) else rig
    evidence = measured_frequencies(tables, structure, preloads=preloads, source=source)
    if evidence.count < LIMITS.fewest_frequencies:
        has, needed = f"holds {evidence.count} natural frequencies", LIMITS.fewest_frequencies
        raise InputError(tables[0].path, "", has, f"a diagnosis needs at least {needed}")
    check_modes(evidence)
    kept = [one for table in held_out for one in sort_by_state([table], evidence.states, source="the RUNs")]
    evidence = with_effects(evidence, source=source)
    felt = felt_causes(evidence)
    search = search_causes(evidence, felt, most=most, effort=WHATEVER, report=report)
    posterior = posterior_of(search)
    verdict = decide(posterior, [])
    after = search.base if verdict in ("none", "unknown") else search.model
    report("predicting left-out frequencies")
    found = _Frequencies(evidence, search, posterior, verdict, (search.base, after), tuple(kept))
    causes = named_causes(search, posterior, [], verdict)
    model = evidence.with_moduli(after.baseline.base)
    model = model.model_copy(update={"effect": [*model.effect, *effects_of(evidence, after)]})
    return TableDiagnosis(
        kind="frequencies",
        rig=rig.name,
        runs=tuple(dict.fromkeys(Path(table.path).name for table in tables)),
        verdict=verdict,
        answer=_answer(verdict, causes, posterior.set_95),
        misfit=found.misfit,
        causes=causes,
        gain=found.gain,
        rows=found.rows,
        tried=found.tried,
        parameters=found.parameters,
        assumed=tuple(_assumed(evidence, felt)),
        notes=tuple(found.notes()),
        model=rig.found(model) if isinstance(rig, BeamRig) else model,
        seconds=time.perf_counter() - started,
        next_test=found.next_mode if verdict == "ambiguous" else "",
        set_95=posterior.set_95,
        excluded=exclusion_limits(evidence, search.stages[-1].scores),
        model_error={"inferred": after.errors.steps.stiffness, "sound": sound_errors(evidence).steps.stiffness},
    )


def _answer(verdict: Verdict, causes: Sequence[NamedCause], set_95: Sequence[str]) -> str:
    named = [cause for cause in causes if cause.in_model]
    what = "; ".join(f"{c.cause} ({parameters_text(c.parameters)}): {c.summary}" for c in named)
    if verdict == "none":
        return "With its moduli identified, the model agrees with the frequencies; nothing needs to be named."
    if verdict == "unknown":
        return "Something is missing from the model, and no cause that frequencies can show explains it."
    if verdict == "ambiguous":
        own = " + ".join(cause.cause for cause in named) or "none"
        rivals = ", ".join(IN_WORDS.get(name, name) for name in set_95 if name != own)
        return f"Most likely {what or IN_WORDS['none']}; these frequencies cannot tell it from {rivals}."
    return f"The frequencies name {what}."


def _assumed(evidence: MeasuredFrequencies, felt: Mapping[str, Cause]) -> list[str]:
    assumed = []
    if evidence.where:
        factor = np.exp(evidence.log_std)
        assumed.append(f"The moduli are identified; before the data each is assumed to a factor of {factor:.2g}.")
    if not evidence.stated:
        assumed.append(
            f"The table gives no std_Hz: each frequency is taken to be good to {100 * IDENTIFY.assumed_std:g} %, "
            f"a figure that is itself right to within a factor of {np.exp(SPREAD):.0f}; all are off by the same factor."
        )
    rare = ", ".join(f"{name} at {odds:g}" for name, odds in RARER_IN_FREQUENCIES.items() if name in felt)
    assumed.append(
        f"A cause is {np.exp(LOG_ODDS_OF_A_CAUSE):g} times as probable beforehand as nothing wrong"
        + (f", and {rare} of that: damage is rarer than what models leave out." if rare else ".")
    )
    silent = ", ".join(name for name, cause in CAUSES.items() if name not in felt and cause.labels(evidence))
    assumed.append(
        "Not tried, since natural frequencies of small motion do not show them, they are identified in any case, or "
        f"this rig has no place for them: {silent}."
    )
    return assumed


@dataclass(frozen=True)
class _Frequencies:
    """A selection on tables, and what there is to say of its models before and after it, and of tables `kept` back."""

    evidence: MeasuredFrequencies
    search: Search
    posterior: Posterior
    verdict: Verdict
    models: tuple[FittedModel, FittedModel]
    kept: tuple[StateFrequencies, ...]

    @property
    def after(self) -> FittedModel:
        """The model that is accepted."""
        return self.models[1]

    @cached_property
    def places(self) -> list[tuple[StateFrequencies, int]]:
        """Table and row of each frequency."""
        return [(table, row) for table in self.evidence.tables for row in range(len(table.number))]

    @cached_property
    def left_out(self) -> tuple[Array, Array]:
        """Relative errors (n,) of each frequency as the models, fitted to all others, predict it."""
        before = self._left_out_of(self.models[0])
        return before, before if self.after is self.models[0] else self._left_out_of(self.after)

    def _left_out_of(self, model: FittedModel) -> Array:
        errors = []
        for index, (table, row) in enumerate(self.places):
            rest = self.evidence.without(index)
            fit = fit_model(
                rest, None, model.baseline, model.hypotheses, errors=model.errors, options=FitOptions(tolerance=0.02)
            )
            one = table.select(np.arange(len(table.number)) == row)
            errors.append(table.frequency_Hz[row] / self._predicted(fit, one)[0] - 1)
        return np.array(errors)

    def _predicted(self, model: FittedModel, table: StateFrequencies) -> Array:
        modification = modification_of(self.evidence, model.hypotheses)
        return FrequencyModel(self.evidence, modification).frequencies(table, model.baseline.base)

    def all_predicted(self, model: FittedModel) -> Array:
        """The model's frequencies of all tables, Hz."""
        return np.concatenate([self._predicted(model, table) for table in self.evidence.tables])

    @property
    def rows(self) -> tuple[FrequencyRow, ...]:
        """What the report shows of each frequency."""
        columns = (*map(self.all_predicted, self.models), *self.left_out)
        return tuple(
            FrequencyRow(table.state, int(table.number[row]), float(table.frequency_Hz[row]), *map(float, values))
            for (table, row), *values in zip(self.places, *columns, strict=True)
        )

    @cached_property
    def misfit(self) -> Misfit:
        """Of the base family, and of the model that is accepted, where they err as sound rigs' models do."""
        stages = (self.search.stages[0], self.search.stages[-1])
        left = [
            unexplained(self.evidence, None, model, stage.tolerances)[1]
            for model, stage in zip(self.models, stages, strict=True)
        ]
        before, after = (
            float(r @ r) / max(1, model.dof) for r, model in zip(left, self.models, strict=True)
        )  # fmt: skip
        share = left[0] ** 2 / max(float(left[0] @ left[0]), 1e-300)
        where: list[dict[str, Any]] = []
        for k in np.argsort(-share)[:8]:
            table, row = self.places[k]
            channel = f"mode {table.number[row]}, {table.state}"
            where.append({"run": Path(table.path).name, "channel": channel, "harmonic": 1, "share": float(share[k])})
        after = before if self.after is self.models[0] else after
        return Misfit(
            chi2_per_dof=before, after=after, threshold=threshold(self.evidence.stated, self.after.dof),
            where=tuple(where),
        )  # fmt: skip

    @property
    def gain(self) -> HeldOutValues:
        """Errors of what was held out."""
        factor = self.after.errors.steps.stiffness / 2 / self.evidence.model_std

        def floor(tables: Sequence[StateFrequencies]) -> float:
            """As stated, else what the model makes most probable."""
            stds = [
                np.hypot(table.std, table.model_std * (1.0 if table.stated else factor)) for table in tables
            ]  # fmt: skip
            return rms(np.concatenate(stds))

        if not self.kept:
            how = "each natural frequency in turn left out and predicted from all others"
            J, covariance = self.after.solution.jacobian, self.after.solution.covariance
            leverage = np.einsum("nu,uv,nv->n", J, covariance, J)
            of_fit = rms(1 / np.sqrt(np.maximum(1 - leverage, 1e-6)))
            return HeldOutValues.of(
                rms(self.left_out[0]), rms(self.left_out[1]), floor(self.evidence.tables), how=how, of_fit=of_fit
            )
        before, after = (
            rms(np.concatenate([table.frequency_Hz / self._predicted(model, table) - 1 for table in self.kept]))
            for model in self.models
        )
        runs = tuple(dict.fromkeys(Path(table.path).name for table in self.kept))
        return HeldOutValues.of(
            before, after, floor(self.kept), how="natural frequencies of the held-out tables", runs=runs
        )

    @property
    def tried(self) -> tuple[Tried, ...]:
        """All models, the likeliest first."""
        stages = self.search.stages
        before, sound = log_weight(self.evidence, stages[0].before), sound_errors(self.evidence)
        std, found = FrequencyModel(self.evidence).error_sources().of_steps(sound.steps).factor[:, 0, 0], []
        for model in (stages[0].before, *(rival for stage in stages for rival in stage.rivals)):
            error = np.log(self.evidence.frequency_Hz / self.all_predicted(model))
            chi2 = float(np.sum((error / std) ** 2)) / max(1, model.dof)
            name = "nothing" if model.name == "none" else model.name
            found.append(Tried(name, log_weight(self.evidence, model) - before, chi2, rms(error)))
        return tuple(sorted(found, key=lambda row: -row.log_evidence))

    @cached_property
    def parameters(self) -> dict[str, tuple[float, Estimate]]:
        """The moduli: as assumed, and as identified."""
        deviation = np.sqrt(np.diag(self.after.solution.covariance))
        moduli, nominal = self.evidence.moduli(self.after.baseline.base), self.evidence.moduli(self.evidence.nominal)
        return {
            name: (nominal[name], Estimate(moduli[name], moduli[name] * float(deviation[place])))
            for name, place in self.evidence.where.items()
        }

    @cached_property
    def next_mode(self) -> str:
        """The unmeasured mode whose frequency tells the best model from its nearest rival."""
        models = [model for model in self.posterior.models if model.name in self.posterior.set_95]
        names = [IN_WORDS.get(model.name, model.name) for model in models]
        found = []
        for table in self.evidence.tables if len(models) > 1 else ():
            wanted = np.setdiff1d(np.arange(1, table.number.max() + 3), table.number)
            ask = replace(table, number=wanted)
            try:
                ours, theirs = (self._predicted(model, ask) for model in models[:2])
            except ValueError:
                continue  # beyond what the mesh shows
            k = int(np.argmax(np.abs(np.log(ours / theirs))))
            text = (
                f"mode {wanted[k]} ({table.state}) would tell them apart: {ours[k]:.5g} Hz by {names[0]}, "
                f"{theirs[k]:.5g} Hz by {names[1]}"
            )
            found.append((float(abs(np.log(ours[k] / theirs[k]))), text))
        return max(found)[1] if found else ""

    def notes(self) -> list[str]:
        """What else there is to know."""
        notes, evidence = [], self.evidence
        if not self.search.complete:
            notes.append("the time limit ended the search: what else there may be is not known")
        if not evidence.stated:
            likely = 100 * self.after.errors.steps.stiffness / 2
            notes.append(
                f"std_Hz is not given: {100 * IDENTIFY.assumed_std:g} % is assumed, known to a factor of "
                f"{np.exp(SPREAD):.0f}; the model makes {likely:.2g} % the most probable"
            )
        if self.after.hypotheses and self.after.dof < 2:
            freedom = f"{max(self.after.dof, 0)} degrees of freedom"
            notes.append(f"the frequencies leave {freedom}: another measured mode would say much more")
        for name, (nominal, found) in self.parameters.items():
            ratio = found.value / nominal
            if abs(np.log(ratio)) > max(3 * found.std / found.value, 0.1):
                notes.append(f"{name} is identified as {found.value:.3g} N/m2, {ratio:.2g} times what was assumed")
        if self.verdict == "ambiguous":
            notes += [note for note in (self.next_mode, self._without_odds()) if note]
        last = self.search.stages[-1]
        if last.rivals and not last.accepted:
            best, beside = last.rivals[0], "as well " if last.before.hypotheses else ""
            gain = log_weight(evidence, best) - log_weight(evidence, last.before)
            notes.append(f"naming {best.hypotheses[-1].key} {beside}would change the log odds by {gain:+.1f}")
        return notes + (self._heavy_sensors() if self.verdict == "none" else [])

    def _without_odds(self) -> str:
        """Said where what is assumed of causes beforehand, and not the data, decides which comes first."""
        if not self.after.hypotheses:
            return ""
        models = next(stage.rivals for stage in reversed(self.search.stages) if stage.accepted)
        first = max(models, key=lambda model: model.log_evidence)
        if first is models[0]:
            return ""
        more = first.log_evidence - models[0].log_evidence
        return (
            f"the frequencies alone favour {first.name} by {more:.1f} in log evidence; it comes later because it is "
            "less probable beforehand"
        )

    def _heavy_sensors(self) -> list[str]:
        """Sensors whose stated mass the frequencies need: agreement may rest on what the rig file says of them."""
        rig, notes = self.evidence.rig, []
        for sensor in rig.response_sensors:
            place = rig.place_of(sensor.channel)
            on_a_beam = isinstance(rig.layout().part(place.part), BeamPart)
            if sensor.mass <= LIMITS.heavy_sensor_kg or not on_a_beam:
                continue
            light = sensor.model_copy(update={"mass": LIMITS.light_sensor_kg})
            sensors = [light if other is sensor else other for other in rig.sensor]
            lighter = self.evidence.against(rig.model_copy(update={"sensor": sensors}))
            fit = fit_base(lighter)
            without = fit_with_errors(lighter, None, fit.baseline, (), errors=fit.errors)
            if self.search.base.log_evidence - without.log_evidence < least_gain(self.evidence):
                continue
            passable = rig.layout().passable
            position = rig.layout().position(rig.place_of(sensor.channel)) if passable else place.at
            assert position is not None
            start = {"mass_kg": sensor.mass - LIMITS.light_sensor_kg, "position_m": position}
            there = CauseHypothesis(CAUSES["added-mass"], {} if passable else {"part": place.part}, start, {})
            asked = fit_model(
                lighter, None, self.search.base.baseline, (there,), options=FitOptions(held=(0, "position_m"))
            )
            (mass,) = asked.hypotheses
            error = rms(np.log(lighter.frequency_Hz / replace(self, evidence=lighter).all_predicted(without)))
            notes.append(
                f"the agreement rests on the {1e3 * sensor.mass:.3g} g that the rig file states of {sensor.channel} at "
                f"{position:g} m: with {1e3 * LIMITS.light_sensor_kg:g} g in its place the frequencies are missed by "
                f"{100 * error:.2g} % rms, and ask for an added mass of "
                f"{Estimate(mass.values['mass_kg'], mass.std['mass_kg']).scaled(1e3)} g there"
            )
        return notes


def threshold(stated: bool, dof: int, probability: float = 0.01) -> float:
    """Chi2 per degree of freedom that a right model exceeds with this probability.

    Standard deviations that are assumed share a factor with a log-normal prior.
    """
    dof = max(1, dof)
    if stated:
        return float(chi_square.isf(probability, dof) / dof)
    logs = np.linspace(-4 * SPREAD, 4 * SPREAD, 81)
    weight = np.exp(-0.5 * (logs / SPREAD) ** 2)
    grid = np.geomspace(0.1, 1e5, 600)
    exceeded = weight / weight.sum() @ chi_square.sf(grid * dof / np.exp(2 * logs)[:, None], dof)
    return float(np.exp(np.interp(-probability, -exceeded, np.log(grid))))
