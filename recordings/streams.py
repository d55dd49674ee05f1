"""Where samples come from and how a procedure talks to a rig: the two seams between the packages.

A :class:`SampleSource` stands behind a virtual instrument (the bench, a recorded run, a test signal), a
:class:`SlowSource` behind a virtual meter.  An
:class:`Acquisition` stands before a procedure (host drivers on a wire, or a source used directly in a rehearsal).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from recordings.run import Channel, Event, SampleBlock


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """What the generator puts out.

    For ``sine``, `amplitude_V` is the peak value; frequency and amplitude may change without a phase jump.
    For ``random``, it is the rms value of Gaussian noise in `band_Hz`, drawn from `seed`.
    For ``multisine``, it is the rms value of a signal that repeats every `period_s`: equally high sines at all
    multiples of 1/`period_s` in `band_Hz`, their phases drawn from `seed`.
    """

    kind: Literal["off", "sine", "random", "multisine"] = "off"
    amplitude_V: float = 0.0
    frequency_Hz: float = 0.0
    band_Hz: tuple[float, float] = (5.0, 1000.0)
    seed: int = 0
    period_s: float = 1.0


class SampleSource(Protocol):
    """Makes samples on demand; knows nothing of wires or of wall-clock time."""

    @property
    def channels(self) -> Sequence[Channel]:
        """The channels it can give, in order."""
        ...

    @property
    def sample_rate_Hz(self) -> float:
        """Rate of the samples that `read` returns."""
        ...

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the nearest rate the converter has, and return it; takes effect at the next `read`."""
        ...

    def set_output(self, excitation: Excitation) -> None:
        """Change the generator's output from the next sample on."""
        ...

    def read(self, count: int) -> SampleBlock:
        """Advance by `count` samples and return them; fewer only at the end of a finite source, then none.

        Indices count from 0 since the source was made; times are nanoseconds of the source's own clock.
        """
        ...


class SlowSource(Protocol):
    """Quantities that change slowly, such as preload and temperature, at any time of the rig."""

    @property
    def channels(self) -> Sequence[Channel]:
        """What there is, in order; without a range where values come as they are, not from a converter."""
        ...

    def read(self, time_s: float) -> Sequence[float]:
        """The value of every channel, in its unit, at a time of the source's clock."""
        ...


class Acquisition(Protocol):
    """A generator and the channels of one rig, however many devices carry them."""

    @property
    def channels(self) -> Sequence[Channel]:
        """All channels, in order."""
        ...

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate of every device; returns the rate obtained.  Only while stopped."""
        ...

    def start(self) -> None:
        """Start streaming; sample indices start from 0."""
        ...

    def stop(self) -> None:
        """Generator to zero, streaming off.  Safe to call twice and after a failure."""
        ...

    def set_output(self, excitation: Excitation) -> int:
        """Change the generator's output; returns the device time (ns) from which it holds."""
        ...

    def read(self, *, timeout_s: float = 2.0) -> Sequence[SampleBlock]:
        """Blocks received since the last call, waiting for at least one.

        Device times of different devices are on one time base.  Raises TimeoutError if nothing came.
        """
        ...

    def take_events(self) -> Sequence[Event]:
        """Losses, overloads, checksum errors, disconnections noticed since the last call."""
        ...
