"""What every cause says of itself: its parameters, what it adds to the forward model, and in words."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.diagnose.limits import LIMITS
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification

Values = Mapping[str, float]
Label = Mapping[str, str]
Labels = Sequence[Label]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a cause, in SI units."""

    name: str
    """As the recording contract fixes it."""
    scale: float
    """Standard deviation of its prior: how large such a fault usually is, around `null`."""
    lower: float
    upper: float
    """Bounds."""
    null: float = float("nan")
    """Value at which the cause has no effect; NaN for a parameter that places an effect and has none."""
    starts: tuple[float, ...] = ()
    """Where a search begins, the likeliest first."""
    tolerance: float = 1e-3
    """Share of the scale that a sound rig's strength differs from `null` by, as a standard deviation: the finite
    elements, the modal damping and the sensors' calibration are themselves no better, and a long record shows it."""
    model_error: float = 0.0
    """Relative error that the cause's own simplification makes of what is found, as blind cases show it: of the
    distance from `null`, or of the value itself where that places an effect."""

    def spread(self, value: float, std: float) -> float:
        """Standard deviation of what was found, from that of the posterior."""
        return float(np.hypot(std, self.model_error * (value if self.is_location else value - self.null)))

    @property
    def is_location(self) -> bool:
        """Whether the parameter only says where or at which frequency an effect is."""
        return bool(np.isnan(self.null))

    @property
    def is_known(self) -> bool:
        """Whether it is told but not looked for: it has one value only."""
        return self.lower == self.upper

    @property
    def is_threshold(self) -> bool:
        """Whether it says from which amplitude or at which frequency on there is an effect, and not where."""
        return self.is_location and not self.is_known and "position" not in self.name

    @property
    def prior(self) -> tuple[float, float]:
        """Mean and precision in units of the scale: one that places an effect has the variance of an even spread."""
        if not self.is_location:
            return self.null / self.scale, 1.0
        width = (self.upper - self.lower) / self.scale
        return (self.lower + self.upper) / 2 / self.scale, 12.0 / width**2

    def difference_step(self, value: float, *, remakes: bool, coarse: float = 0.0) -> float:
        """Step of a difference quotient, `coarse` of the parameter's size at the least.

        Small for a strength or a threshold, because near a sharp resonance the residual bends within a thousandth of a
        stiffness; coarser along the structure.  Where a cause remakes the structure its modes are solved anew, and
        their rounding is a millionth of a usual strength: a step of that size finds some tenths of the sensitivity to
        be noise, and the fit creeps.
        """
        along = self.is_location and not self.is_threshold
        size = self.scale + (0.0 if self.is_location else abs(value - self.null))
        return max(coarse, 1e-3 if along else 3e-4 if remakes else 1e-5) * size


class Cause(ABC):
    """One way in which the rig may differ from what is assumed.

    A model is ``model.py`` of the cause's folder in ``twin/causes``: its name and parameters, fixed by the recording
    contract, an :class:`~twin.identify.model_modification.ModelModification` of the forward model, and a sentence.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    tried_at_full_size: ClassVar[bool] = False
    """Whether a search fits it from its usual size even where its first order at nothing promises no gain: an effect
    that the base family's own law imitates leaves no slope there, nor does one that moves resonances by many widths
    from sweep to sweep."""
    numbers: ClassVar[tuple[Parameter, ...]] = ()
    """The numbers to be found, where they depend neither on the rig nor on what was measured."""

    def labels(self, evidence: MeasuredData) -> Labels:
        """Choices that are names, such as the channel at fault: one search each; a single empty one by default."""
        return ({},)

    def assumed(self, evidence: MeasuredData) -> Label:
        """Names that a rig file may leave out, and what is meant then; none by default."""
        return {}

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """The numbers to be found; the first one with a null value is the effect's strength."""
        return self.numbers

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Values and standard deviations under the contract's names, where a search wants others."""
        return dict(values), dict(std)

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the inverse of :meth:`reported`, with what is not reported at its likeliest."""
        return dict(values)

    def shared(
        self, evidence: MeasuredData, label: Label, baseline: BaselineParameters, values: Values
    ) -> tuple[BaselineParameters, dict[str, float]]:
        """Where a fit begins: what the data only know of the base family and the cause together, shared by the priors.

        A fit need not creep along a line on which nothing changes; by default nothing is shared.
        """
        return baseline, dict(values)

    @abstractmethod
    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """What differs from the nominal rig at these values."""

    def begun(self, evidence: MeasuredData, label: Label) -> ModelModification:
        """The same where a search begins first; in the middle of a range of which nothing says where."""
        parameters = self.parameters(evidence, label)
        values = {p.name: p.starts[0] if p.starts else (p.lower + p.upper) / 2 for p in parameters}
        return self.modification(evidence, label, values)


def strengths_of(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The parameters that have a value without effect, the main one first; none where an effect has no strength."""
    return tuple(p for p in parameters if not p.is_location)


def thresholds(largest: float, *, least: float) -> tuple[float, ...]:
    """Where an effect may begin in a motion up to `largest`: down to a share `least` of that, the likeliest first."""
    shares = (
        np.geomspace(1.0, least, 1 + round(np.log(1 / least) / np.log(LIMITS.cause_ratio)))[1:]
        * LIMITS.cause_ratio**0.5
    )
    return tuple(largest * share for share in sorted(shares, key=lambda share: abs(float(np.log(2 * share)))))


def measured_duration_s(evidence: MeasuredData) -> float:
    """From the first step of all runs to the last that is used; at least ten seconds, a scale for what drifts."""
    times = [*evidence.steps.time_s, *(data.time_s for data in evidence.broadband)]
    return max(float(max(times)) - evidence.origin_s if times else 0.0, 10.0)


def fall_per_second(evidence: MeasuredData, *, scale: float, most: float, least: float, start: float) -> Parameter:
    """How fast something falls, as a share of it per second; given are the shares over the whole measurement."""
    over, least, most, start = (share / measured_duration_s(evidence) for share in (scale, least, most, start))
    return Parameter(name="rate_per_s", scale=over, lower=least, upper=most, null=0.0, starts=(start,))


def shaker_labels(evidence: MeasuredData) -> Labels:
    """What a shaker brings along: a single search without a name, and none where an ideal force drives."""
    return () if evidence.rig.shaker.ideal else ({},)


def response_channels(evidence: MeasuredData) -> tuple[dict[str, str], ...]:
    """One label for each response channel."""
    return tuple({"channel": name} for name in evidence.channels)


def all_channels(evidence: MeasuredData) -> tuple[dict[str, str], ...]:
    """One label for each channel, the force's last."""
    return (*response_channels(evidence), {"channel": evidence.force})
