"""Where a force is missing, how it depends on the motion there, and the simplest terms that make it."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from twin.arrays import Array
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.missing.force import LocalForce, law_of, named_law, peak_and_fundamental
from twin.diagnose.missing.terms import TERMS, Term
from twin.diagnose.model_evidence import fit_with_errors
from twin.diagnose.places import along_beam, place_at
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE, log_weight
from twin.diagnose.selection.search import Report, Search, search_causes
from twin.identify.estimate import Estimate
from twin.identify.measured_data import MeasuredData


@dataclass(frozen=True, kw_only=True)
class FittedTerm:
    """A term with its coefficient, whose unit is ``term.unit``."""

    term: Term
    coefficient: Estimate


@dataclass(frozen=True, kw_only=True)
class ForceAtLevel:
    """The force at the largest motion of one sweep."""

    sweep: str
    frequency_Hz: float
    displacement_m: float
    force_N: float
    """Largest within a period."""
    phase_deg: float | None
    """Of its fundamental, ahead of the displacement: 0 is a spring, 90 a damper, 180 a mass.  None where it has next
    to none, as a force that is the same to either side."""


@dataclass(frozen=True, kw_only=True)
class MissingForce:
    """The picture that the data support of a force nobody has named."""

    places_m: Array
    """Along the structure, (p,)."""
    left: Array
    """Chi2 per degree of freedom with the force of these terms at each of them, all else refitted, (p,)."""
    position_m: Estimate
    """Where it fits best."""
    terms: tuple[FittedTerm, ...]
    """The simplest law that fits."""
    levels: tuple[ForceAtLevel, ...]
    before: float
    after: float
    """Chi2 per degree of freedom without and with the force."""

    @property
    def formula(self) -> str:
        """Such as ``c u³ + c v``."""
        return " + ".join(fitted.term.formula for fitted in self.terms)

    @property
    def explains(self) -> bool:
        """Whether the model follows the data with it; else nothing that acts at one place does."""
        return self.after < max(LIMITS.picture_follows, LIMITS.most_left * self.before)

    def force(self, u: Array, v: Array, a: Array) -> Array:
        """The force at displacement, velocity and acceleration of its place."""
        return sum((f.coefficient.value * f.term.force(u, v, a) for f in self.terms), np.zeros(np.shape(u)))

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "position_m": asdict(self.position_m),
            "formula": self.formula,
            "explains": self.explains,
            "terms": [
                {"term": f.term.name, "formula": f.term.formula, "unit": f.term.unit, **asdict(f.coefficient)}
                for f in self.terms
            ],
            "chi2_per_dof": {"before": self.before, "after": self.after},
            "along": [
                {"position_m": float(x), "chi2_per_dof": float(left)}
                for x, left in zip(self.places_m, self.left, strict=True)
            ],
            "levels": [asdict(level) for level in self.levels],
        }


def find_missing_force(evidence: MeasuredData, *, report: Report = lambda text: None) -> MissingForce | None:
    """Ask the data for a force at one place that the base family lacks.

    None where no force of these terms at any one place takes a share of the misfit away: what is wrong is then none.
    """
    if not evidence.rig.layout().passable:
        return None  # its place is sought along one line of beams
    report("looking for a missing force")
    search = search_causes(evidence, {LocalForce.name: LocalForce()}, most=1, report=report)
    if not search.model.hypotheses:
        return None
    model = _at_sound_errors(search, _with_further_terms(search, report))
    report("moving the force along the structure")
    places, left = _along_the_structure(search, model)
    hypothesis = model.hypotheses[-1]
    return MissingForce(
        places_m=places,
        left=left,
        position_m=Estimate(hypothesis.values["position_m"], hypothesis.std["position_m"]),
        terms=tuple(
            FittedTerm(term=term, coefficient=Estimate(hypothesis.values[term.name], hypothesis.std[term.name]))
            for term in law_of(hypothesis.label)
        ),
        levels=_at_each_level(search.evidence, model),
        before=_at_sound_errors(search, search.base).chi2_per_dof,
        after=model.chi2_per_dof,
    )


def _at_sound_errors(search: Search, model: FittedModel) -> FittedModel:
    """The model as it fits where it may be wrong by no more than a sound rig's: what it leaves then is missing."""
    return fit_model(
        search.evidence, search.harmonics, model.baseline, model.hypotheses,
        options=FitOptions(iterations=10, tolerance=0.3),
    )  # fmt: skip


def _along_the_structure(search: Search, model: FittedModel) -> tuple[Array, Array]:
    """Chi2 per degree of freedom with the same terms at each place, all else refitted, beginning from a neighbour's."""
    evidence, harmonics = search.evidence, search.harmonics
    hypothesis = model.hypotheses[-1]
    here = hypothesis.values["position_m"]
    places = np.array(along_beam(evidence, hypothesis.label, LIMITS.picture_places)[::-1])
    left = np.empty(len(places))
    for side in (places <= here, places > here):
        neighbour = model
        for i in sorted(np.flatnonzero(side), key=lambda i: abs(places[i] - here)):
            last = neighbour.hypotheses[-1]
            moved = replace(last, values=_moved(evidence, last, float(places[i])))
            neighbour = fit_model(
                evidence, harmonics, neighbour.baseline, (moved,),
                options=FitOptions(iterations=8, tolerance=2.0, held=(0, "position_m")),
            )  # fmt: skip
            left[i] = neighbour.chi2_per_dof
    return places, left


def _moved(evidence: MeasuredData, hypothesis: CauseHypothesis, position_m: float) -> dict[str, float]:
    """The force's values at another place, where it does the same to mode 1."""
    structure, shape = evidence.model.structure, evidence.model.basis.Phi[:, 0]
    places = (
        place_at(evidence, hypothesis.label, {"position_m": x}) for x in (hypothesis.values["position_m"], position_m)
    )
    here, there = (abs(float(structure.row(place) @ shape)) for place in places)
    # A term of power p works with the power p + 1 of the motion of its place.
    scaled = {
        term.name: hypothesis.values[term.name] * (here / there) ** (term.power + 1)
        for term in law_of(hypothesis.label)
    }
    return {**hypothesis.values, **scaled, "position_m": position_m}


def _with_further_terms(search: Search, report: Report) -> FittedModel:
    """The model with as many terms at its place as the data pay for."""
    best, evidence, harmonics = search.model, search.evidence, search.harmonics
    while len(law_of(best.hypotheses[-1].label)) < 3:
        report(f"asking whether {best.hypotheses[-1].label['law']} is all")
        hypotheses = [_with_term(best.hypotheses[-1], term, evidence) for term in TERMS.values()]
        tried = [
            fit_with_errors(
                evidence, harmonics, best.baseline, (hypothesis,), errors=best.errors, options=FitOptions(tolerance=2.0)
            )
            for hypothesis in hypotheses
            if hypothesis is not None
        ]
        further = max(tried, key=lambda trial: trial.log_evidence)
        if log_weight(evidence, further) + LOG_ODDS_OF_A_CAUSE <= log_weight(evidence, best):
            break
        best = further
    return best


def _with_term(hypothesis: CauseHypothesis, term: Term, evidence: MeasuredData) -> CauseHypothesis | None:
    """The force with a little of a further term; None if it has that already."""
    terms = law_of(hypothesis.label)
    if term in terms:
        return None
    label = {"law": named_law((*terms, term))}
    small = next(p for p in hypothesis.cause.parameters(evidence, label) if p.name == term.name).scale * 1e-3
    return CauseHypothesis(hypothesis.cause, label, {**hypothesis.values, term.name: small}, {})


def _at_each_level(evidence: MeasuredData, model: FittedModel) -> tuple[ForceAtLevel, ...]:
    """The force where each sweep moves its place most."""
    if not len(evidence.steps):
        return ()
    hypothesis = model.hypotheses[-1]
    balance = model.residual_model(evidence).step_receptance(model.baseline, inner=False)[2]
    motion = balance.motion[:, -1]  # its force comes last
    amplitude, omega = np.abs(motion), evidence.steps.omega
    sweeps = evidence.steps.by_sweep
    largest = {sweep: int(rows[np.argmax(amplitude[rows])]) for sweep, rows in sweeps.items()}
    chosen = np.array(list(largest.values()))
    peak, fundamental = peak_and_fundamental(hypothesis, amplitude[chosen], omega[chosen])
    return tuple(
        ForceAtLevel(
            sweep=sweep,
            frequency_Hz=float(omega[i] / (2 * np.pi)),
            displacement_m=float(amplitude[i]),
            force_N=float(largest_N),
            phase_deg=float(np.degrees(np.angle(first))) if abs(first) > LIMITS.least_fundamental * largest_N else None,
        )
        for (sweep, i), largest_N, first in zip(largest.items(), peak, fundamental, strict=True)
    )
