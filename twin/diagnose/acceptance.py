"""Whether a cause is worth its parameters: what the data must gain before one is added, and when one has gone."""

from __future__ import annotations

from dataclasses import replace

from twin.diagnose.baseline_fit import FOLLOWS
from twin.diagnose.cause import main_strength
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, fit_model
from twin.diagnose.successive_halving import LEAST_GAIN
from twin.identify.measured_data import MeasuredData
from twin.identify.whitening import HarmonicResiduals

__all__ = ["FALSE", "LEAST_SHARE", "acceptance", "expected_residual", "left_by_effects", "promising", "pruned"]

LEAST_SHARE = 0.08
"""Least share of chi2 that a cause must take away: what is left of a clean rig's is the model's own error as much as
noise, and there is always something that would follow a twentieth of that."""
LEAST_SHARE_OF_HARMONICS = 0.15
"""The same of the steps' higher harmonics, where a stop or a slap shows while the broadband runs know nothing of it."""
FALSE = 0.5
"""Share of chi2 that is left from another start where the first one had led into a false minimum."""
CLEAR = 2.0
"""Standard deviations from nothing."""
CHANCE = 0.25
"""Part of what a cause must gain that a rough fit to thinner evidence must show of it."""
OWN_ERROR = 0.1
"""Largest model error of a cause that counts as leaving chi2 behind: larger ones say that strength and place are known
only together, not that the cause fits badly."""


def acceptance(
    evidence: MeasuredData, finalists: list[FittedModel], model: FittedModel, expected_residual_chi2: float
) -> tuple[FittedModel, ...]:
    """Finalists that are accepted beside a model whose causes leave `expected_residual_chi2` anyway.

    One that follows the noise best may yet be too slight to be a cause; the next may not.
    """
    alone = not (model.hypotheses or evidence.effects)
    return tuple(
        finalist for finalist in finalists
        if _is_accepted(evidence, finalist, model, by_strain=alone)
        and (alone or model.solution.chi2 - finalist.solution.chi2 > expected_residual_chi2)
    )  # fmt: skip


def promising(trials: list[FittedModel], model: FittedModel) -> list[FittedModel]:
    """The rough fits that leave a chance that the data would pay for them, beside as rough a fit of the model."""
    before, harmonics = model.solution, model.chi2_of("harmonics")

    def has_a_chance(trial: FittedModel) -> bool:
        relief = 0.5 * (before.penalty - trial.solution.penalty)
        return (
            relief > CHANCE * LEAST_GAIN
            or before.chi2 - trial.solution.chi2 > CHANCE * LEAST_SHARE * before.chi2
            or harmonics - trial.chi2_of("harmonics") > CHANCE * LEAST_SHARE_OF_HARMONICS * harmonics
        )

    return [trial for trial in trials if has_a_chance(trial)]


def expected_residual(evidence: MeasuredData, hypothesis: CauseHypothesis, gain: float) -> float:
    """Chi2 that a cause whose model is wrong by a known share leaves of its own effect: no sign of a further cause."""
    errors = [p.model_error for p in hypothesis.cause.parameters(evidence, hypothesis.label)]
    return _left(max(errors, default=0.0), gain)


def left_by_effects(evidence: MeasuredData, harmonics: HarmonicResiduals | None, base: FittedModel) -> float:
    """Chi2 that effects of the rig file leave: as found causes, and by how well their strengths were known to it."""
    total = 0.0
    for effect in evidence.effects:
        assert isinstance(effect, CauseHypothesis)
        parameters = effect.cause.parameters(evidence, effect.label)
        errors = [p.model_error for p in parameters]
        main = main_strength(parameters)
        if main is not None and main.name in effect.std and (strength := abs(effect.values[main.name] - main.null)):
            errors.append(effect.std[main.name] / strength)
        if not any(errors):
            continue
        rest = replace(evidence, effects=tuple(other for other in evidence.effects if other is not effect))
        without = fit_model(rest, harmonics, base.baseline, (), tolerance=0.3)
        total += _left(max(errors), without.solution.chi2 - base.solution.chi2)
    return total


def _left(error: float, gain: float) -> float:
    return min(error, OWN_ERROR) ** 2 * max(gain, 0.0)


def pruned(evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel) -> FittedModel:
    """Drop causes that the others have made superfluous, the earliest first: it was found when least was known."""
    for key in [hypothesis.key for hypothesis in model.hypotheses]:
        if len(model.hypotheses) < 2:
            break
        hypothesis = next(b for b in model.hypotheses if b.key == key)
        rest = tuple(b for b in model.hypotheses if b.key != key)
        without = fit_model(evidence, harmonics, model.baseline, rest, tolerance=0.3)
        if not _is_accepted(evidence, model, without, hypothesis):
            model = without
    return model


def _is_accepted(
    evidence: MeasuredData,
    fitted_model: FittedModel,
    model: FittedModel,
    hypothesis: CauseHypothesis | None = None,
    *,
    by_strain: bool = True,
) -> bool:
    """Whether a cause, the last one by default, is worth its parameters beside the model without it.

    What the base family can follow only by unlikely values, such as one mode's damping, costs no chi2.  A new cause may
    pay `by_strain` alone, not beside another or an effect of the rig file: the base family also makes up for what the
    other's model has wrong.
    """
    hypothesis = hypothesis or fitted_model.hypotheses[-1]
    overdispersion = fitted_model.chi2_per_dof
    gain = fitted_model.weight(overdispersion) - model.weight(overdispersion)
    relief = 0.5 * (model.solution.penalty - fitted_model.solution.penalty)
    strained = by_strain and relief > LEAST_GAIN and _clear(evidence, hypothesis)
    enough = (
        strained
        or fitted_model.solution.chi2 < (1 - LEAST_SHARE) * model.solution.chi2
        or fitted_model.chi2_of("harmonics") < (1 - LEAST_SHARE_OF_HARMONICS) * model.chi2_of("harmonics")
    )
    # While neither follows the data, how far either strains the base family says little beside the share it explains.
    far = fitted_model.chi2_per_dof > FOLLOWS and fitted_model.solution.cost < FALSE * model.solution.cost
    return (gain > LEAST_GAIN or far) and enough and not _negligible(evidence, hypothesis)


def _clear(evidence: MeasuredData, hypothesis: CauseHypothesis) -> bool:
    """Whether a cause's strength is known to be there: one that only takes strain off the base family must be."""
    main = main_strength(hypothesis.cause.parameters(evidence, hypothesis.label))
    return main is None or abs(hypothesis.values[main.name] - main.null) > CLEAR * hypothesis.std[main.name]


def _negligible(evidence: MeasuredData, hypothesis: CauseHypothesis) -> bool:
    strengths = [p for p in hypothesis.cause.parameters(evidence, hypothesis.label) if not p.places]
    return bool(strengths) and all(abs(hypothesis.values[p.name] - p.null) < p.negligible * p.scale for p in strengths)
