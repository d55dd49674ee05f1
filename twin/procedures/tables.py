"""The procedure file, field by field.  SI units throughout."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = [
    "Controller",
    "Dwell",
    "Grid",
    "Limits",
    "Measure",
    "Phase",
    "Procedure",
    "Random",
    "RingDown",
    "Settle",
    "SteppedSine",
    "SweptSine",
]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Frequency = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Duration = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=64)]

MOST_STEPS = 20_000


class Table(BaseModel):
    """A TOML table: unknown keys are errors, so that a misspelt field is not silently a default."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Grid(Table):
    """Frequencies of a sweep, Hz, from `start` to `stop` (both included, `start` < `stop`).

    ``linear`` takes `step`; ``logarithmic`` takes `count`; ``adaptive`` goes in steps of `step` where the response
    hardly changes and down to `smallest` where a step would change it by more than `change` of its own size.
    """

    kind: Literal["linear", "logarithmic", "adaptive"] = "linear"
    start: Frequency
    stop: Frequency
    step: Positive | None = None
    count: Annotated[int, Field(ge=2, le=MOST_STEPS)] | None = None
    smallest: Positive | None = None
    change: Annotated[float, Field(gt=0, le=2)] = 0.25

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.stop <= self.start:
            raise ValueError(
                f"stop {self.stop:g} must lie above start {self.start:g}; 'direction' says which way to go"
            )
        wanted, other = ("count", "step") if self.kind == "logarithmic" else ("step", "count")
        if getattr(self, wanted) is None:
            raise ValueError(f"a {self.kind} grid needs '{wanted}'")
        if getattr(self, other) is not None:
            raise ValueError(f"a {self.kind} grid takes '{wanted}', not '{other}'")
        if (self.kind == "adaptive") != (self.smallest is not None):
            raise ValueError("'smallest', the finest step, belongs to an adaptive grid and is needed there")
        finest = self.smallest if self.smallest is not None else self.step
        if finest is not None and (self.stop - self.start) / finest > MOST_STEPS:
            raise ValueError(f"more than {MOST_STEPS} steps")
        return self


class Settle(Table):
    """The wait before each measurement: `seconds` as given, or until the data say so.

    Automatic: wait until what is left of the transient, extrapolated from how it decays, is below `tolerance` of the
    response, at least `minimum` and at most `maximum` seconds.  Short detours of the frequency shorten it by a third or
    so; `detours` = false forbids them.
    """

    seconds: Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)] | None = None
    tolerance: Annotated[float, Field(gt=0, le=0.5)] = 5e-4
    minimum: NonNegative = 0.0
    maximum: Duration = 60.0
    detours: bool = True

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = self.model_fields_set & {"tolerance", "minimum", "maximum"}
        if self.seconds is not None and given:
            raise ValueError(f"'seconds' fixes the wait; it excludes {', '.join(sorted(given))}")
        if self.minimum > self.maximum:
            raise ValueError(f"minimum {self.minimum:g} exceeds maximum {self.maximum:g}")
        return self


class Measure(Table):
    """How long each step is measured: whole cycles, at least `seconds` or exactly `cycles`."""

    seconds: Duration | None = None
    cycles: Annotated[int, Field(ge=1, le=1_000_000)] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.seconds is None) == (self.cycles is None):
            raise ValueError("give either 'seconds' or 'cycles'")
        return self

    def duration_s(self, frequency_Hz: float) -> float:
        """Length of the measurement at one frequency, s."""
        if self.cycles is not None:
            return self.cycles / frequency_Hz
        assert self.seconds is not None
        return max(1, round(self.seconds * frequency_Hz + 0.499)) / frequency_Hz


class Limits(Table):
    """What must never be exceeded.

    The generator saturates at `voltage` (peak).  A sample of a channel beyond its `peak` switches the generator off
    and ends the run.
    """

    voltage: Positive = 10.0
    peak: dict[Name, Positive] = {}


class Controller(Table):
    """Amplitude control: what counts as held, and the voltage it starts from when nothing is known of the rig."""

    tolerance: Annotated[float, Field(gt=0, le=0.5)] = 0.005
    start_voltage: Positive = 0.01


class Phase(Table):
    """Phase resonance: `channel` lags the force by 90 degrees of displacement, within `tolerance` degrees."""

    channel: Name
    tolerance: Annotated[float, Field(gt=0, le=45)] = 0.5
    widest: Positive | None = None
    """How far the frequency may move from where it started, Hz; a tenth of it if not given."""


class _Common(Table):
    sample_rate: Annotated[float, Field(ge=1, le=1e7)]
    store: Literal["all", "settled"] = "settled"
    limits: Limits = Limits()
    controller: Controller = Controller()
    target_channel: Name = "force"


class _Sine(_Common):
    """What all sine procedures share."""

    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 2048.0
    amplitudes: list[Positive] = Field(min_length=1, max_length=1000)
    direction: Literal["up", "down", "both"] = "up"
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
        if 2.5 * highest > self.sample_rate:
            raise ValueError(
                f"sample_rate {self.sample_rate:g} Hz is too low for {highest:g} Hz; at least {2.5 * highest:g}"
            )
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


class Random(_Common):
    """Gaussian noise in a band, Hz, with the `rms` of the target channel (or of the voltage) for `duration` seconds."""

    procedure: Literal["random"] = "random"
    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 5120.0
    band: tuple[NonNegative, Positive]
    rms: Positive
    duration: Duration
    control: Literal["force", "response", "voltage"] = "force"
    controller: Controller = Controller(tolerance=0.1)
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1
    settle: Settle = Settle(seconds=5.0)

    @model_validator(mode="after")
    def _band(self) -> Self:
        if self.band[1] <= self.band[0]:
            raise ValueError(f"band must increase, got {list(self.band)}")
        if 2.5 * self.band[1] > self.sample_rate:
            raise ValueError(
                f"sample_rate {self.sample_rate:g} Hz is too low for {self.band[1]:g} Hz; at least "
                f"{2.5 * self.band[1]:g}"
            )
        if self.settle.seconds is None:
            raise ValueError("random excitation settles for a fixed time: settle.seconds")
        return self


class SweptSine(_Common):
    """A sine whose frequency runs from `start` to `stop`, Hz, at `rate`, Hz/s, at a fixed voltage amplitude."""

    procedure: Literal["swept-sine"] = "swept-sine"
    sample_rate: Annotated[float, Field(ge=1, le=1e7)] = 2048.0
    start: Frequency
    stop: Frequency
    rate: Positive
    voltages: list[Positive] = Field(min_length=1, max_length=1000)
    direction: Literal["up", "down", "both"] = "up"

    @model_validator(mode="after")
    def _range(self) -> Self:
        if self.stop <= self.start:
            raise ValueError(
                f"stop {self.stop:g} must lie above start {self.start:g}; 'direction' says which way to go"
            )
        if 2.5 * self.stop > self.sample_rate:
            raise ValueError(f"sample_rate {self.sample_rate:g} Hz is too low; at least {2.5 * self.stop:g}")
        return self


Procedure = SteppedSine | Dwell | RingDown | Random | SweptSine
