"""What a diagnosis says, as the command line's contract has it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from twin.cause_registry import advice_on
from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.gain import Gain
from twin.diagnose.answer.misfit import Misfit, Verdict
from twin.diagnose.answer.parameter_text import parameters_text
from twin.diagnose.answer.shortfall import explains, shortfall, told_with
from twin.diagnose.missing import MissingForce
from twin.diagnose.posterior import Weighed
from twin.diagnose.selection.search import Search
from twin.identify.estimate import Estimate
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import SOUND

IN_WORDS = {"none": "no cause at all", "unknown": "something that is on no list"}


@dataclass(frozen=True, kw_only=True)
class NamedCause:
    """A cause with its probability, its parameters, and what it could be confused with."""

    cause: str
    summary: str
    """One sentence for an engineer."""
    probability: float
    confused_with: tuple[str, ...]
    parameters: Mapping[str, Estimate | str | tuple[int, ...]]
    """Estimates, names such as the channel, and the nodes of a region."""
    in_model: bool
    """Whether the extended model holds it."""

    @property
    def advice(self) -> str:
        """What to do on the rig, and where to read on; empty on a cause from outside the package."""
        advice = advice_on(self.cause)
        return "" if advice is None else f"{advice.on_the_rig}  More in {advice.page}."


@dataclass(frozen=True, kw_only=True)
class NextSensor:
    """Where one more accelerometer would help, and why."""

    why: str
    part: str
    at: float
    direction: tuple[float, float, float]
    """Its place: metres along a beam or a node of a part given by matrices, and a unit vector."""
    separation: float
    needed: float
    """As of :class:`NextTest`."""


@dataclass(frozen=True, kw_only=True)
class NextTest:
    """What to measure next, and why."""

    why: str
    procedure: str
    separation: float
    needed: float
    """Gain of log evidence that it is expected to bring to the true one of the rivals, and what would be enough."""
    rig_time_s: float
    """As rehearsed."""
    sensor: NextSensor | None = None
    """What another accelerometer would bring instead, where noise was recorded."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The whole answer, with what the pictures need."""

    verdict: Verdict
    misfit: Misfit
    causes: tuple[NamedCause, ...]
    gain: Gain | None
    next_test: NextTest | None
    seconds: float
    evidence: MeasuredData
    search: Search
    sweeps: tuple[SweepComparison, ...]
    held_out: tuple[SweepComparison, ...]
    notes: tuple[str, ...] = ()
    extended_model: str = ""
    missing_force: MissingForce | None = None
    set_95: tuple[str, ...] = ()
    excluded: tuple[Exclusion, ...] = ()
    hypotheses: tuple[Weighed, ...] = ()
    files: tuple[str, ...] = ()
    """Of the recordings, those held out among them."""

    @property
    def shortfall(self) -> str:
        """What the model leaves unexplained; empty where that is nothing."""
        return shortfall(self.verdict, self.misfit, self.gain)

    @property
    def sentence(self) -> str:
        """The answer in one sentence, behind one on what it leaves unexplained."""
        return told_with(self._answer(), self.shortfall)

    def _answer(self) -> str:
        named = [c for c in self.causes if c.in_model]
        if self.verdict == "none" and self.shortfall:
            return "No cause on the list was named."
        if self.verdict == "none":
            return "The model agrees with the data to within their noise; nothing needs to be named."
        if self.verdict == "unknown" and not self.search.complete:
            return f"The time limit ended the search before it came to an answer; {self._looked_at()}."
        if self.verdict == "unknown":
            return f"Something is missing from the model, and no cause on the list explains it{self._hint()}."
        what = "; ".join(f"{c.cause} ({parameters_text(c.parameters)}): {c.summary}" for c in named)
        if self.verdict == "ambiguous":
            own = {" + ".join(c.cause for c in named), *(c.cause for c in named)}
            rivals = ", ".join(IN_WORDS.get(name, name) for name in self.set_95 if name not in own)
            return f"Most likely {what or IN_WORDS['none']}; these data cannot tell it from {rivals}."
        return f"The data name {what}."

    def _looked_at(self) -> str:
        """What the search had fitted when it ended."""
        fitted = {h.cause.name for stage in self.search.stages for one in stage.rivals for h in one.hypotheses}
        return f"it had looked at {', '.join(sorted(fitted))}" if fitted else "it had fitted no cause yet"

    def _hint(self) -> str:
        """What the data say of a force that is missing."""
        force = self.missing_force
        if force is None or not force.explains:
            return ", nor does a force of simple terms at any one place"
        return (
            f"; a force {force.formula} at {force.position_m.value:.3g} m would bring chi² per degree of freedom from "
            f"{force.before:.3g} to {force.after:.3g}"
        )

    def to_dict(self) -> dict[str, Any]:
        """The contract's JSON object."""
        return {
            **answer_dict(self.verdict, self.sentence, self.misfit, self.causes),
            "set_95": list(self.set_95),
            "excluded": [asdict(limit) for limit in self.excluded],
            "hypotheses": [asdict(hypothesis) for hypothesis in self.hypotheses],
            "model_error": {"inferred": self.search.model.errors.steps.stiffness, "sound": SOUND.steps.stiffness},
            "explains": explains(self.verdict, self.shortfall),
            "gain": None
            if self.gain is None
            else {
                "held_out": {
                    "before": self.gain.before,
                    "after": self.gain.after,
                    "noise_floor": self.gain.noise_floor,
                    "expected": self.gain.expected,
                    "in_deviations": self.gain.in_deviations[1],
                },
                "by_harmonic": {str(harmonic): asdict(part) for harmonic, part in self.gain.by_harmonic.items()},
                "runs": list(self.gain.runs),
                "sweeps": list(self.gain.sweeps),
            },
            "next_test": None if self.next_test is None else asdict(self.next_test),
            "missing_force": None if self.missing_force is None else self.missing_force.to_dict(),
            "extended_model": self.extended_model,
            "notes": list(self.notes),
            "seconds": self.seconds,
        }


def answer_dict(verdict: Verdict, sentence: str, misfit: Misfit, causes: tuple[NamedCause, ...]) -> dict[str, Any]:
    """What every diagnosis answers, of recordings and of tables alike, as the contract has it."""
    return {
        "verdict": verdict,
        "answer": sentence,
        "misfit": {**asdict(misfit), "where": list(misfit.where)},
        "causes": [
            {
                "cause": c.cause,
                "summary": c.summary,
                "advice": c.advice,
                "probability": c.probability,
                "confused_with": list(c.confused_with),
                "in_model": c.in_model,
                "parameters": {
                    name: {"value": value.value, "std": value.std}
                    if isinstance(value, Estimate)
                    else value
                    if isinstance(value, str)
                    else list(value)
                    for name, value in c.parameters.items()
                },
            }
            for c in causes
        ],
    }
