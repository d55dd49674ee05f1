"""What the diagnosis of a table says, in the contract's form."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Self

from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.misfit import HeldOut
from twin.diagnose.answer.result import Estimate, Misfit, NamedCause, Verdict, answer_dict
from twin.diagnose.answer.shortfall import explains, shortfall, told_with
from twin.rigs import Rig
from twin.rigs.beam import BeamRig
from twin.rigs.modal import ModalRig


@dataclass(frozen=True)
class HeldOutValues(HeldOut):
    """Errors of values of a table; in deviations, those of its values as a whole."""

    how: str = field(kw_only=True)
    """In words, where no runs or sweeps are named."""

    @classmethod
    def of(
        cls, before: float, after: float, noise_floor: float, *, how: str, of_fit: float = 1.0, **named: tuple[str, ...]
    ) -> Self:
        """With what a right model leaves over the noise: few values tell its parameters, and their noise is in them."""
        expected = max(of_fit * noise_floor, 1e-300)  # a table may claim to have no noise
        return cls(before, after, noise_floor, in_deviations=(before / expected, after / expected), how=how, **named)


@dataclass(frozen=True)
class FrequencyRow:
    """One natural frequency: measured, with moduli alone, with what is named; errors measured over model minus one."""

    condition: str
    mode: int
    measured_Hz: float
    before_Hz: float
    after_Hz: float
    left_out_before: float
    left_out_after: float


@dataclass(frozen=True)
class Tried:
    """A model that was tried: what it names, and its log evidence above that of naming nothing."""

    hypotheses: str
    log_evidence: float
    chi2_per_dof: float
    rms_error: float


@dataclass(frozen=True)
class SweepRow:
    """One sweep against the smooth law of all others."""

    sweep: str
    order: int
    """In the file, from 1."""
    amplitude_m_per_s2: float
    frequency_Hz: float
    damping_ratio: float
    """Of the sweep by itself."""
    shift_Hz: float
    """Its resonance minus the law's."""
    force_error: float
    own_error: float
    """Rms relative error of the force: by the others' law, and by the sweep's own linear mode."""
    shifted: bool
    inside: bool
    """Whether the others reach below and above its amplitude, so that the law is not extrapolated."""


@dataclass(frozen=True, kw_only=True)
class TableDiagnosis:
    """The whole answer."""

    kind: str
    """``frequencies`` or ``sweeps``."""
    rig: str
    runs: tuple[str, ...]
    verdict: Verdict
    answer: str
    """What the verdict means, in one sentence."""
    misfit: Misfit
    causes: tuple[NamedCause, ...]
    gain: HeldOutValues | None
    rows: tuple[FrequencyRow, ...] | tuple[SweepRow, ...]
    """What the tables of the report show."""
    tried: tuple[Tried, ...]
    """All models, the likeliest first."""
    parameters: Mapping[str, tuple[float, Estimate]]
    """What was identified beside the causes: assumed value (NaN if there is none) and estimate."""
    assumed: tuple[str, ...]
    notes: tuple[str, ...]
    model: Rig | BeamRig | ModalRig
    seconds: float
    next_test: str = ""
    """What would tell rivals apart; empty if there are none."""
    set_95: tuple[str, ...] = ()
    excluded: tuple[Exclusion, ...] = ()
    model_error: Mapping[str, float] = field(default_factory=dict)
    """Of frequencies, as :class:`~twin.diagnose.answer.result.Diagnosis` has them of recordings."""

    @property
    def shortfall(self) -> str:
        """What the model leaves unexplained; empty where that is nothing."""
        return shortfall(self.verdict, self.misfit, self.gain)

    @property
    def sentence(self) -> str:
        """The answer in one sentence, behind one on what it leaves unexplained."""
        return told_with(self.answer, self.shortfall)

    def to_dict(self, extended_model: str) -> dict[str, Any]:
        """The contract's JSON object; `extended_model` is the file's name."""
        return {
            **answer_dict(self.verdict, self.sentence, self.misfit, self.causes),
            **({"set_95": list(self.set_95)} if self.set_95 else {}),
            **({"excluded": [asdict(limit) for limit in self.excluded]} if self.excluded else {}),
            **({"model_error": dict(self.model_error)} if self.model_error else {}),
            "explains": explains(self.verdict, self.shortfall),
            "gain": None if self.gain is None else {
                "held_out": {
                    "before": self.gain.before, "after": self.gain.after, "noise_floor": self.gain.noise_floor,
                },
                "how": self.gain.how,
                "runs": list(self.gain.runs),
                "sweeps": list(self.gain.sweeps),
            },
            "identified": {
                name: {"value": estimate.value, "std": estimate.std, "nominal": nominal}
                for name, (nominal, estimate) in self.parameters.items()
            },
            "tried": [asdict(model) for model in self.tried],
            "next_test": {"why": self.next_test, "procedure": None} if self.next_test else None,
            "extended_model": extended_model,
            "assumed": list(self.assumed),
            "notes": list(self.notes),
            "seconds": self.seconds,
        }  # fmt: skip
