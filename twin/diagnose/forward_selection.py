"""One ascent: the best cause is added to the model again and again while the data pay for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from twin.diagnose.acceptance import FALSE, acceptance, expected_residual, promising, pruned
from twin.diagnose.baseline_fit import FOLLOWS, BaselineFit
from twin.diagnose.cause import Cause, main_strength
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, fit_model, modification_of
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.score import Score, score_causes
from twin.diagnose.screening import screening
from twin.diagnose.successive_halving import (
    DISCREPANCY_LEVELS,
    LEAST_GAIN,
    Report,
    at_the_best_place,
    best_of_each,
    fitted_to_the_end,
    successive_halving,
    with_own_law,
)
from twin.diagnose.thinned_data import thinned_data
from twin.diagnose.thresholds import refined
from twin.identify.base_fit import starting_baseline
from twin.identify.baseline_parameters import LOOSE, TIGHT, BaselineParameters
from twin.identify.harmonics import harmonic_residuals
from twin.identify.measured_data import MeasuredData
from twin.identify.rebinning import rebinned
from twin.identify.residual_model import ResidualModel
from twin.identify.whitening import HarmonicResiduals

__all__ = ["EXPLAINED", "ForwardSelection", "Stage"]

RIVAL = 1.5
"""Chi2 over the best finalist's up to which another is fitted to all evidence."""
EXPLAINED = 0.9
"""Chi2 per degree of freedom at which an extended model needs no other reduction of the recordings, nor beginning: in
blind cases the right causes left 0.4 to 0.6, seldom 0.8, and a wrong pair 0.95 or more."""
PROMISING = 16.0
"""First-order gain of chi2 from which on a further cause is looked for: beside the right one, clean rigs' best is five.
Whatever is left may be small on the whole, as broadband runs count most, and yet all there is of a second cause."""
SLIGHT = 0.01
"""Share of a usual strength from which a cause that got lost begins again."""
REDUCED_ANEW = 2
"""Times that the recordings are reduced against a model and it is fitted to them, while it does not explain them."""


@dataclass(frozen=True)
class Stage:
    """One turn of the search: the models that were tried, best evidence first, and the first-order scores.

    `acceptance` are those of them that the data would pay for.
    """

    finalists: tuple[FittedModel, ...]
    scores: tuple[Score, ...]
    acceptance: tuple[FittedModel, ...]

    @property
    def accepted(self) -> bool:
        """Whether the first model was taken: the data pay for one."""
        return bool(self.acceptance)


class ForwardSelection:
    """Where an ascent stands.

    Parameters
    ----------
    evidence, causes, baseline fit, report
        As for :func:`~twin.diagnose.search.search_causes`.
    expected : float
        What of chi2 the rig file's effects leave anyway.

    Attributes
    ----------
    base : FittedModel
        The base family alone, in the best minimum that was found.
    model : FittedModel
        The base family with the causes so far.
    stages : list of Stage
        The turns that were taken.
    evidence : MeasuredData
        The recordings, as they were reduced against what was found last.
    harmonics : HarmonicResiduals, optional
        Of the steps, likewise.
    """

    def __init__(
        self,
        evidence: MeasuredData,
        causes: Mapping[str, Cause],
        baseline_fit: BaselineFit,
        expected_residual_chi2: float,
        report: Report,
    ) -> None:
        self.base = self.model = baseline_fit.base
        self.stages: list[Stage] = []
        self._causes, self._report = causes, report
        # Where the next cause is scored from, and the discrepancy with which its rivals begin.
        self._start, self._discrepancy = baseline_fit.start, baseline_fit.discrepancy
        # How many causes the model had that was last fitted anew; and what of chi2 the causes so far leave anyway.
        self._settled, self._left_behind = -1, expected_residual_chi2
        self._use(evidence, baseline_fit.harmonics)

    def _use(self, evidence: MeasuredData, harmonics: HarmonicResiduals | None) -> None:
        self.evidence, self.harmonics = evidence, harmonics
        self._thin = thinned_data(evidence, harmonics)

    def add_causes(self, most: int, *, first: Stage | None = None) -> None:
        """Add up to `most` causes; what `first` has found already is taken."""
        while len(self.model.hypotheses) < most:
            stage = self._look_further() if first is None or self.stages else first
            if stage is None:
                break
            self.stages.append(stage)
            if not stage.accepted:
                break
            self._take(stage.finalists[0])
        if len(self.model.hypotheses) > 1:
            self._report("asking whether every cause is needed")
            self.model = pruned(self.evidence, self.harmonics, self.model)

    def _look_further(self) -> Stage | None:
        """Rivals for the next cause; None where nothing promises one."""
        kept: tuple[FittedModel, ...] = ()
        while True:
            scores = self._scores()
            promise = max((score.gain for score in scores), default=0.0)
            if self.model.hypotheses and not kept and promise < self._least_promise():
                return None
            finalists = self._finalists(scores, kept)
            pay, anew = self._paying(finalists)
            if anew is None:
                if pay:
                    finalists = finalists[finalists.index(pay[0]) :]
                return Stage(tuple(finalists), tuple(scores), pay)
            # From the better minimum what was found beside the other one may have no slope to be seen by.
            kept = pay
            self._begin_from(anew)

    def _paying(self, finalists: list[FittedModel]) -> tuple[tuple[FittedModel, ...], FittedModel | None]:
        """Finalists that pay, once even beside the model fitted anew.

        The second is that fit where the model had come to rest in a false minimum, and was scored there.
        """
        pay = acceptance(self.evidence, finalists, self.model, self._left_behind)
        known = len(self.model.hypotheses)
        if not finalists or self._settled == known or (known and not pay):
            return pay, None
        self._settled = known
        anew = _anew(self.evidence, self.harmonics, self.model, finalists[0].baseline)
        if anew.log_evidence <= self.model.log_evidence + LEAST_GAIN:
            return pay, None
        pay = acceptance(self.evidence, finalists, anew, self._left_behind)
        false = not pay or anew.solution.chi2 < FALSE * self.model.solution.chi2
        return pay, anew if false else None

    def _scores(self) -> list[Score]:
        named = {hypothesis.cause.name for hypothesis in self.model.hypotheses}
        further = f"looking for a further cause beside {self.model.hypotheses[-1].key}" if named else "scoring causes"
        self._report(further)
        left = {name: cause for name, cause in self._causes.items() if name not in named}
        return score_causes(*self._thin, replace(self.model, baseline=self._start), left)

    def _least_promise(self) -> float:
        """First-order gain below which no further cause is looked for."""
        return max(PROMISING, self._left_behind * _count(self._thin[0]) / _count(self.evidence))

    def _finalists(self, scores: list[Score], kept: tuple[FittedModel, ...]) -> list[FittedModel]:
        """The best models with one more cause, fitted to all evidence, and those kept; the most probable first."""
        evidence, harmonics = self.evidence, self.harmonics
        rivals = [(*self.model.hypotheses, hypothesis) for hypothesis in screening(self._thin[0], scores)]
        trials = successive_halving(*self._thin, self._start, rivals, self._discrepancy, self._report)
        trials = at_the_best_place(*self._thin, trials, scores)
        if trials:
            as_rough = fit_model(*self._thin, self._start, self.model.hypotheses, tolerance=2.0)
            trials = promising(trials, as_rough)
        if not trials:
            return list(kept)
        # Where not even the best follows the data, any may be the first of two.
        if (least := trials[0].chi2_per_dof) < FOLLOWS:
            trials = [trial for trial in trials if trial.chi2_per_dof <= RIVAL * least]
        field = [(trial.baseline, trial.hypotheses) for trial in trials]
        self._report(f"refitting {', '.join(hypotheses[-1].key for _, hypotheses in field)} to all evidence")
        finalists = parallel_map(fitted_to_the_end, (evidence, harmonics), field)
        if min(c.solution.cost for c in finalists) > self.model.solution.cost:
            # No minimum lies above that without the cause: all came to rest in false ones on their way from afar.
            field = [(self.model.baseline, _from_nothing(evidence, trial.hypotheses)) for trial in trials]
            finalists += parallel_map(fitted_to_the_end, (evidence, harmonics), field)
        finalists = best_of_each(sorted([*finalists, *kept], key=lambda c: -c.log_evidence))
        begin = partial(with_own_law, evidence, harmonics, discrepancy=TIGHT)
        finalists[0] = refined(evidence, harmonics, finalists[0], begin=begin)
        overdispersion = finalists[0].chi2_per_dof
        return sorted(finalists, key=lambda c: -c.weight(overdispersion))

    def _begin_from(self, anew: FittedModel) -> None:
        """Go on from a better minimum of the same model."""
        if not self.model.hypotheses:
            self.base = anew
        self.model, self._start = anew, anew.baseline
        if anew.chi2_per_dof < FOLLOWS:
            self._discrepancy = TIGHT

    def _take(self, found: FittedModel) -> None:
        """Make a finalist the model, and reduce the recordings against it until it explains them."""
        before, self.model = self.model, found
        self._left_behind += expected_residual(
            self.evidence, found.hypotheses[-1], before.solution.chi2 - found.solution.chi2
        )
        for turn in range(REDUCED_ANEW):
            # What was reduced against a model far off also has that model's errors in it.
            if self.model.chi2_per_dof < EXPLAINED and (turn or before.chi2_per_dof < FOLLOWS):
                break
            self._report("reducing the recordings anew, against the model found")
            self._use(*_reduced_anew(self.evidence, self.harmonics, self.model))
            self.model = fit_model(
                self.evidence, self.harmonics, self.model.baseline, self.model.hypotheses, tolerance=0.3
            )
        chi2 = self.model.chi2_per_dof
        self._discrepancy = next(
            (discrepancy for discrepancy in DISCREPANCY_LEVELS if chi2 < FOLLOWS * discrepancy.error_scale**2),
            DISCREPANCY_LEVELS[-1],
        )
        self._start = self.model.baseline
        if self._discrepancy is not TIGHT:
            loose = fit_model(
                self.evidence, self.harmonics, self._start, self.model.hypotheses, discrepancy=LOOSE, iterations=8
            )
            self._start = loose.baseline


def _from_nothing(evidence: MeasuredData, hypotheses: tuple[CauseHypothesis, ...]) -> tuple[CauseHypothesis, ...]:
    """CauseHypotheses of which the last has hardly begun to act."""
    *before, last = hypotheses
    main = main_strength(last.cause.parameters(evidence, last.label))
    if main is None:
        return hypotheses
    slight = main.null + SLIGHT * main.scale * (1.0 if main.upper > main.null else -1.0)
    return (*before, replace(last, values={**last.values, main.name: slight}))


def _anew(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, start: BaselineParameters
) -> FittedModel:
    """The model fitted again as thoroughly as its rivals with a further cause: from where the best of them ended.

    With causes, also from the beginning: they were found beside a base family that had to make up for them.
    """
    best = fit_model(evidence, harmonics, start, model.hypotheses, tolerance=0.3)
    if not model.hypotheses:
        return best
    baseline, hypotheses = (
        starting_baseline(evidence, modification=modification_of(evidence, model.hypotheses)),
        model.hypotheses,
    )
    for discrepancy in reversed(DISCREPANCY_LEVELS):
        trial = fit_model(evidence, harmonics, baseline, hypotheses, discrepancy=discrepancy, tolerance=0.3)
        baseline, hypotheses = trial.baseline, trial.hypotheses
    trial = fitted_to_the_end(evidence, harmonics, baseline, hypotheses)
    return max(best, trial, key=lambda fitted_model: fitted_model.log_evidence)


def _reduced_anew(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel
) -> tuple[MeasuredData, HarmonicResiduals | None]:
    """Broadband runs binned, and the force's own harmonics carried to the channels, with the model found so far."""
    modification = modification_of(evidence, model.hypotheses)
    if evidence.broadband:
        evidence = rebinned(evidence, modification, model.baseline)
    if harmonics is not None:
        # What local nonlinear forces add is the prediction's matter.
        harmonics = harmonic_residuals(ResidualModel(evidence, replace(modification, nonlinear=())), model.baseline)
    return evidence, harmonics


def _count(evidence: MeasuredData) -> int:
    """Measured responses."""
    return sum(data.H.size for data in evidence.broadband) + evidence.steps.response[:, :, :1].size
