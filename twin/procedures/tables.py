"""The tables that procedures share, field by field.  SI units throughout."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from recordings.directions import Towards
from recordings.numbers import NonNegative, Positive
from recordings.toml_input import Name, Table

Frequency = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Duration = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]

Direction = Literal["up", "down", "both"]

MOST_STEPS = 20_000


def ways(direction: Direction) -> tuple[str, ...]:
    """The ways that sweeps go, one after the other."""
    return ("up", "down") if direction == "both" else (direction,)


def check_range(start: float, stop: float) -> None:
    """ValueError if a sweep's frequencies do not rise."""
    if stop <= start:
        raise ValueError(f"stop {stop:g} must lie above start {start:g}; 'direction' says which way to go")


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
        check_range(self.start, self.stop)
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
    peak: dict[Name, Positive] = Field(default={})


class Controller(Table):
    """Amplitude control: what counts as held, and the voltage it starts from when nothing is known of the rig."""

    tolerance: Annotated[float, Field(gt=0, le=0.5)] = 0.005
    start_voltage: Positive = 0.01


class Point(Table):
    """Where a hammer hits, or a roving accelerometer sits: a place on a part of the rig, and a direction there."""

    name: Name
    part: Name
    at: NonNegative
    direction: Towards = "+y"


class Hammer(Table):
    """How the twin's hammer hits: half sines of `width` seconds, `peak` newtons high, which scatter by a share.

    The hits that `double_hits` names, counted from 1 over the whole test, bounce and hit a second time.
    """

    peak: Positive = 30.0
    scatter: Annotated[float, Field(ge=0, le=0.2)] = 0.1
    width: Annotated[float, Field(gt=0, le=0.1)] = 5e-4
    double_hits: list[Annotated[int, Field(ge=1)]] = Field(default=[], max_length=1000)
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1


class Phase(Table):
    """Phase resonance: `channel` lags the force by 90 degrees of displacement, within `tolerance` degrees."""

    channel: Name
    tolerance: Annotated[float, Field(gt=0, le=45)] = 0.5
    widest: Positive | None = None
    """How far the frequency may move from where it started, Hz; a tenth of it if not given."""
