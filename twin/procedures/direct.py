"""A sample source driven directly, with no wire between: for rehearsals faster than real time."""

from collections.abc import Sequence

from recordings.run import Channel, Event, SampleBlock
from recordings.streams import Excitation, SampleSource


class DirectAcquisition:
    """An :class:`~recordings.streams.Acquisition` over a :class:`~recordings.streams.SampleSource`.

    Parameters
    ----------
    block_s
        Length of the blocks that `read` returns, s.  The procedure reacts at block ends only, as on a wire.
    """

    def __init__(self, source: SampleSource, *, block_s: float = 0.125) -> None:
        self._source, self._block_s = source, block_s
        self._next_ns = 0
        self._running = False

    @property
    def channels(self) -> Sequence[Channel]:
        """The source's channels."""
        return self._source.channels

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the nearest rate the source has; returns it."""
        return self._source.set_sample_rate(sample_rate_Hz)

    def start(self) -> None:
        """Begin to read."""
        self._running = True

    def stop(self) -> None:
        """Generator to zero."""
        self._source.set_output(Excitation())
        self._running = False

    def set_output(self, excitation: Excitation) -> int:
        """Change the output from the next sample on; returns that sample's time, ns."""
        self._source.set_output(excitation)
        return self._next_ns

    def read(self, *, timeout_s: float = 2.0) -> Sequence[SampleBlock]:
        """The next block, at once; a source at its end raises TimeoutError, as an instrument that fell silent would."""
        if not self._running:
            raise TimeoutError("the acquisition was not started")
        count = max(1, round(self._block_s * self._source.sample_rate_Hz))
        block = self._source.read(count)
        if len(block) == 0:
            raise TimeoutError(f"no samples within {timeout_s:g} s: the source is at its end")
        self._next_ns = block.end_ns
        return [block]

    def take_events(self) -> Sequence[Event]:
        """None: nothing is lost without a wire, and overloads are in the blocks."""
        return []
