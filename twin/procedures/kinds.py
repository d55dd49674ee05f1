"""The procedures there are, field by field.  SI units throughout."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from recordings.numbers import NonNegative, Positive
from recordings.toml_input import Name, Table
from twin.procedures.tables import (
    MOST_STEPS,
    Controller,
    Direction,
    Duration,
    Frequency,
    Grid,
    Hammer,
    Limits,
    Measure,
    Phase,
    Point,
    Settle,
    check_range,
)


class _Common(Table):
    """What all procedures share.

    With ``store = "all"`` the file's time is the rig's.  ``"settled"`` leaves the waits out: a smaller file, whose time
    runs on from one measured stretch to the next.
    """

    sample_rate: Annotated[float, Field(ge=1, le=1e7)]
    store: Literal["all", "settled"] = "all"
    limits: Limits = Limits()
    controller: Controller = Controller()
    target_channel: Name = "force"
    drive: Name | None = None
    """Which of the rig's drives is run; the first of its file if left out."""

    def _check_rate(self, highest_Hz: float) -> None:
        rate, least = self.sample_rate, 2.5 * highest_Hz
        if least > rate:
            raise ValueError(f"sample_rate {rate:g} Hz is too low for {highest_Hz:g} Hz; at least {least:g}")


class _Sine(_Common):
    """What all sine procedures share."""

    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 2048.0
    amplitudes: list[Positive] = Field(min_length=1, max_length=1000)
    direction: Direction = "up"
    control: Literal["force", "response", "voltage", "phase-resonance"] = "force"
    settle: Settle = Settle()
    measure: Measure = Measure(seconds=2.0)
    phase: Phase | None = None

    @model_validator(mode="after")
    def _phase_where_needed(self) -> Self:
        if (self.control == "phase-resonance") != (self.phase is not None):
            raise ValueError("the table 'phase' belongs to control = 'phase-resonance' and is needed there")
        return self


class SteppedSine(_Sine):
    """Sweeps in steps of frequency, one for each amplitude and direction.

    With ``control = "phase-resonance"`` the frequency follows the resonance from the only one given, and the steps of
    a sweep are the `amplitudes`, up, down or both: the backbone.  With ``order = "amplitude"`` the steps of a sweep
    are the amplitudes too, one sweep for each frequency and direction: an amplitude ladder.
    """

    procedure: Literal["stepped-sine"] = "stepped-sine"
    frequencies: list[Frequency] = Field(default=[], max_length=MOST_STEPS)
    grid: Grid | None = None
    order: Literal["frequency", "amplitude"] = "frequency"

    @model_validator(mode="after")
    def _one_grid(self) -> Self:
        if bool(self.frequencies) == (self.grid is not None):
            raise ValueError("give either 'frequencies' or a 'grid'")
        if self.control == "phase-resonance" and len(self.frequencies) != 1:
            raise ValueError("control = 'phase-resonance' starts from one frequency: frequencies = [f]")
        if any(b <= a for a, b in zip(self.frequencies, self.frequencies[1:], strict=False)):
            raise ValueError("frequencies must increase; 'direction' says which way to go")
        highest = self.grid.stop if self.grid else self.frequencies[-1]
        self._check_rate(highest)
        if self.order == "amplitude" and self.grid is not None and self.grid.kind == "adaptive":
            raise ValueError("an amplitude ladder takes fixed frequencies, not an adaptive grid")
        return self


class Dwell(_Sine):
    """Each amplitude held at one frequency for `duration` seconds after settling."""

    procedure: Literal["dwell"] = "dwell"
    frequency: Frequency
    duration: Duration

    @model_validator(mode="after")
    def _own_measure(self) -> Self:
        if "measure" in self.model_fields_set:
            raise ValueError("a dwell measures for its 'duration'; it takes no table 'measure'")
        return self


class RingDown(_Sine):
    """Each amplitude held at one frequency until settled, then the generator to zero and `duration` seconds recorded.

    The decay is a step of its own with target amplitude 0.
    """

    procedure: Literal["ring-down"] = "ring-down"
    frequency: Frequency
    duration: Duration


class _Broadband(_Common):
    """What broadband procedures share: a `band`, Hz, and the `rms` of the target channel (or of the voltage) in it."""

    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 5120.0
    band: tuple[NonNegative, Positive]
    rms: Positive
    control: Literal["force", "response", "voltage"] = "force"
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1

    @model_validator(mode="after")
    def _band(self) -> Self:
        if self.band[1] <= self.band[0]:
            raise ValueError(f"band must increase, got {list(self.band)}")
        self._check_rate(self.band[1])
        return self


class Random(_Broadband):
    """Gaussian noise for `duration` seconds."""

    procedure: Literal["random"] = "random"
    duration: Duration
    controller: Controller = Controller(tolerance=0.1)
    settle: Settle = Settle(seconds=5.0)

    @model_validator(mode="after")
    def _fixed_wait(self) -> Self:
        if self.settle.seconds is None:
            raise ValueError("random excitation settles for a fixed time: settle.seconds")
        return self


class Multisine(_Broadband):
    """Equally high sines at all multiples of 1/`period` in the band, phases drawn from `seed`; `periods` are measured.

    Once the response has settled it repeats with the excitation: no leakage, and what differs from period to period is
    noise.  The automatic wait compares periods.
    """

    procedure: Literal["multisine"] = "multisine"
    period: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
    periods: Annotated[int, Field(ge=1, le=10_000)] = 4
    controller: Controller = Controller(tolerance=0.02)
    settle: Settle = Settle(tolerance=2e-3)

    @model_validator(mode="after")
    def _lines(self) -> Self:
        samples = self.period * self.sample_rate
        if abs(samples - round(samples)) > 1e-6 * samples:
            raise ValueError(f"a period of {self.period:g} s is no whole number of samples at {self.sample_rate:g} Hz")
        if math.floor(self.band[1] * self.period) < max(1, math.ceil(self.band[0] * self.period)):
            raise ValueError(f"no multiple of 1/period, {1 / self.period:g} Hz, lies in the band")
        return self


class SweptSine(_Common):
    """A sine whose frequency runs from `start` to `stop`, Hz, at `rate`, Hz/s, at a fixed voltage amplitude."""

    procedure: Literal["swept-sine"] = "swept-sine"
    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 2048.0
    start: Frequency
    stop: Frequency
    rate: Positive
    voltages: list[Positive] = Field(min_length=1, max_length=1000)
    direction: Direction = "up"

    @model_validator(mode="after")
    def _range(self) -> Self:
        check_range(self.start, self.stop)
        self._check_rate(self.stop)
        return self


class Impact(_Common):
    """`hits` of an instrumented hammer at each `point`, each recorded for `record` seconds; no shaker is attached.

    A record begins `pre_trigger` seconds before the force passes `trigger`, N; a hit is waited for up to `patience`
    seconds.  The hammer roves over the points and the sensors stay; or the accelerometer `sensor` roves over them, and
    the drive's place is hit.  Without points the drive's place is hit, and nothing roves.
    """

    procedure: Literal["impact"] = "impact"
    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 5120.0
    store: Literal["all", "settled"] = "settled"
    hits: Annotated[int, Field(ge=1, le=1000)] = 4
    record: Duration
    pre_trigger: NonNegative = 0.02
    trigger: Positive = 2.0
    patience: Duration = 120.0
    roving: Literal["hammer", "accelerometer"] = "hammer"
    sensor: Name | None = None
    point: list[Point] = Field(default=[], max_length=1000)
    hammer: Hammer = Hammer()

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if self.pre_trigger >= self.record:
            raise ValueError(f"pre_trigger {self.pre_trigger:g} must be shorter than record {self.record:g}")
        if (self.roving == "accelerometer") != (self.sensor is not None):
            raise ValueError("'sensor' names the accelerometer that roves: it belongs to roving = 'accelerometer'")
        names = [point.name for point in self.point]
        if len(set(names)) < len(names):
            raise ValueError("the points' names must be unique")
        if self.trigger > (1 - 3 * self.hammer.scatter) * self.hammer.peak:
            raise ValueError(f"trigger {self.trigger:g} N is not reached by every hit of {self.hammer.peak:g} N")
        if max(self.hammer.double_hits, default=0) > self.hits * len(self.places):
            raise ValueError(f"hammer.double_hits: there are {self.hits * len(self.places)} hits")
        return self

    @property
    def places(self) -> tuple[str, ...]:
        """Names of the points, or of the drive's place where there are none."""
        return tuple(point.name for point in self.point) or (self.drive or "drive",)


Procedure = SteppedSine | Dwell | RingDown | Random | Multisine | SweptSine | Impact
