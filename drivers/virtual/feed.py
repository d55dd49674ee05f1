"""One source of samples for all instruments of a rig: what has been made, what may be made next, when outputs change.

The instruments share the converter's clock, a trigger line (a start on one starts those that are armed) and a pulse
line (a pulse every 100 ms, which every instrument stamps with its own clock so that a host can align them).
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation, SampleSource

PULSES_PER_S = 10


class SourceFailedError(Exception):
    """The source cannot give samples any more; the text says why."""


class SampleFeed:
    """Advances a source block by block.

    Parameters
    ----------
    source
        The rig, a recorded run or a test signal.
    flow_controlled
        Whether the feed waits for acknowledgements where a client has asked for a window; a rig in real time
        does not wait for anybody.
    renew
        Makes a source in place of one that has failed; without it a failure is for good.

    Attributes
    ----------
    index
        Samples made so far.
    finished
        Whether a finite source has come to its end.
    failure
        Why the source has stopped to give samples, in words; empty if it has not.
    latched
        Whether it was stopped in an emergency, and stays so until that is cleared.
    block_length
        Samples to make at a time.
    limit
        Sample beyond which a client's window forbids to go, or None.
    """

    def __init__(
        self, source: SampleSource, *, flow_controlled: bool, renew: Callable[[], SampleSource] | None = None
    ) -> None:
        self._source = source
        self._renew = renew
        self._base = (0, 0)  # what a renewed source's numbers and times are counted from
        self._flow_controlled = flow_controlled
        self._rate_Hz = source.sample_rate_Hz
        self._next_time_ns = 0
        self._scheduled: deque[tuple[int, Excitation]] = deque()
        self._armed: list[Callable[[], None]] = []
        self._pulse_origin = 0
        self.index = 0
        self.finished = False
        self.failure = ""
        self.latched = False
        self._halted = False
        self.block_length = 240
        self.limit: int | None = None

    @property
    def channels(self) -> Sequence[Channel]:
        """Channels of the source."""
        return self._source.channels

    @property
    def sample_rate_Hz(self) -> float:
        """Rate of the next block."""
        return self._rate_Hz

    @property
    def next_time_ns(self) -> int:
        """Time of sample `index`."""
        return self._next_time_ns

    @property
    def may_advance(self) -> bool:
        """Whether the source works, and neither its end nor a client's window is reached."""
        return not (self.finished or self.failure) and (
            not self._flow_controlled or self.limit is None or self.index < self.limit
        )

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the rate of the converter; gives the one obtained.

        Raises
        ------
        SourceFailedError
            If the source does not survive it.
        """
        try:
            self._rate_Hz = self._source.set_sample_rate(sample_rate_Hz)
        except Exception as error:  # whatever it is, it must not take the instruments down
            self._fail(error)
            raise SourceFailedError(self.failure) from error
        return self._rate_Hz

    def schedule_output(self, excitation: Excitation) -> tuple[int, int]:
        """Change the generator's output as soon as possible; gives the sample and the time from which it holds.

        With a window it is the window's end, wherever the feed has got to: a rehearsal as fast as the machine can
        then repeats sample by sample, however its processes are scheduled.
        """
        at = self.index
        if self._flow_controlled and self.limit is not None:
            at = max(at, self.limit)
        self._scheduled.append((at, excitation))
        return at, self._next_time_ns + round((at - self.index) * 1e9 / self._rate_Hz)

    def advance(self, longest: int) -> SampleBlock | None:
        """The next block, of at most `longest` samples; None when a finite source has ended, or one has failed."""
        try:
            return self._advance(longest)
        except Exception as error:  # whatever it is, it must not take the instruments down
            self._fail(error)
            return None

    def _fail(self, error: Exception) -> None:
        self._scheduled.clear()
        known = isinstance(error, (ArithmeticError, ValueError, OSError))
        self.failure = " ".join((str(error) if known and str(error) else repr(error)).split())

    def halt(self, reason: str, *, latched: bool = False) -> None:
        """Stop at once, with the generator's output at zero from the next sample on; safe in a signal's handler.

        Parameters
        ----------
        reason
            What the clients are told.
        latched
            Whether somebody must clear it before it goes on: an emergency stop.
        """
        self._scheduled = deque([(0, Excitation())])
        self._halted = self._halted or not self.failure
        self.latched = self.latched or latched
        self.failure = reason

    def recover(self) -> None:
        """Begin anew after a failure, at rest, with numbers and times that go on; else do nothing.

        Raises
        ------
        SourceFailedError
            If there is no way to.
        """
        if not self.failure:
            return
        if self.latched:
            raise SourceFailedError(self.failure)
        if self._halted:
            self._halted, self.failure = False, ""
            return
        if self._renew is None:
            raise SourceFailedError(self.failure)
        try:
            self._source = self._renew()
            self._rate_Hz = self._source.set_sample_rate(self._rate_Hz)
        except Exception as error:
            self._fail(error)
            raise SourceFailedError(self.failure) from error
        self._base = self.index, self._next_time_ns
        self.failure = ""

    def _advance(self, longest: int) -> SampleBlock | None:
        while self._scheduled and self._scheduled[0][0] <= self.index:
            self._source.set_output(self._scheduled.popleft()[1])
        count = min(self.block_length, longest)
        if self._flow_controlled and self.limit is not None:
            count = min(count, max(1, self.limit - self.index))
        if self._scheduled:
            count = min(count, self._scheduled[0][0] - self.index)
        block = self._source.read(count)
        if len(block) < count:
            self.finished = True
        if not len(block):
            return None
        if self._base != (0, 0):
            index, time_ns = self._base
            block = replace(block, first_index=block.first_index + index, time_ns=block.time_ns + time_ns)
        self._rate_Hz = block.sample_rate_Hz
        self.index = block.first_index + len(block)
        self._next_time_ns = block.end_ns
        return block

    def arm(self, start: Callable[[], None]) -> None:
        """Call `start` at the next trigger."""
        if start not in self._armed:
            self._armed.append(start)

    def disarm(self, start: Callable[[], None]) -> None:
        """Do not call it after all."""
        if start in self._armed:
            self._armed.remove(start)

    def trigger(self) -> None:
        """Start every armed instrument with the next sample; pulses count from here."""
        self._pulse_origin = self.index
        armed, self._armed = self._armed, []
        for start in armed:
            start()

    def pulses(self, block: SampleBlock) -> Iterator[tuple[int, int]]:
        """Number and sample index of each pulse in a block: the first sample at or after every 100 ms."""
        interval = block.sample_rate_Hz / PULSES_PER_S
        offset = block.first_index - self._pulse_origin
        number = max(0, int(offset / interval) - 1)
        while (at := int(-(-number * interval // 1))) < offset + len(block):
            if at >= offset:
                yield number, self._pulse_origin + at
            number += 1
