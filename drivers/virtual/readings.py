"""The plain half of the instrument's acquisition: READ? and FETCh?, one definite-length block an answer."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.scpi import Deferred, Integer, ScpiError, command
from drivers.virtual.feed import SampleFeed, SourceFailedError
from drivers.virtual.generator import AMPLIFIER_V, Generator

READ_LIMIT = 65536


@dataclass
class _Reading:
    """A READ? that waits for its samples."""

    count: int
    answer: Deferred
    parts: list[NDArray[np.float32]]


class Readings(Generator):
    """A generator whose samples can be read a block at a time.

    Parameters
    ----------
    feed
        Where samples come from.
    drive_limit_V
        Of its generator.
    """

    def __init__(self, feed: SampleFeed, *, drive_limit_V: float = AMPLIFIER_V) -> None:
        super().__init__(feed, drive_limit_V=drive_limit_V)
        self._reading: _Reading | None = None
        self._recent: deque[NDArray[np.float32]] = deque()
        self._recent_count = 0

    @property
    def reading(self) -> bool:
        """Whether a READ? waits."""
        return self._reading is not None

    @property
    def listening(self) -> bool:
        """Whether a client waits for samples."""
        return self.reading

    def begin(self) -> None:
        """Make ready to acquire: settings applied, a source that works.

        Raises
        ------
        ScpiError
            If what is measured gives nothing.
        """
        try:
            self._feed.recover()
        except SourceFailedError as error:
            raise ScpiError(-300, str(error)) from error
        self.end_message()

    def self_test(self) -> int:
        """Whether there is something to measure: 0, or 1 if it has failed and cannot be begun anew."""
        try:
            self._feed.recover()
        except SourceFailedError:
            return 1
        return 0

    def take_readings(self, values: NDArray[np.float32]) -> None:
        """Samples of all channels, shape (channels, n): for a READ? that waits, and kept for FETCh?."""
        self._recent.append(values)
        self._recent_count += values.shape[1]
        while self._recent_count - self._recent[0].shape[1] >= READ_LIMIT:
            self._recent_count -= self._recent.popleft().shape[1]
        reading = self._reading
        if reading is None:
            return
        reading.parts.append(values[:, : reading.count])
        reading.count -= reading.parts[-1].shape[1]
        if reading.count == 0:
            self._reading = None
            reading.answer.finish(np.concatenate(reading.parts, axis=1).astype("<f4").tobytes())

    def abandon_reading(self, error: ScpiError | None = None) -> bool:
        """A READ? that waits gets no samples, but an error or, if its client has left, nothing; whether one waited."""
        reading, self._reading = self._reading, None
        if reading is not None and error is not None:
            reading.answer.finish(error)
        return reading is not None

    @command("READ?", Integer(minimum=1, maximum=READ_LIMIT), controls=True)
    def _read(self, count: int) -> Deferred:
        """The next samples, channel after channel, as a definite-length block of little-endian float32."""
        if self.listening:
            raise ScpiError(-221, "already acquiring")
        self.begin()
        self._reading = _Reading(count, Deferred(), [])
        return self._reading.answer

    @command("FETCh?", Integer(minimum=1, maximum=READ_LIMIT), optional=1)
    def _fetch(self, count: int = READ_LIMIT) -> bytes:
        """The latest samples already taken, in the form of READ?."""
        self._refuse_while_streaming()
        if not self._recent:
            raise ScpiError(-221, "nothing has been acquired")
        return np.concatenate(list(self._recent), axis=1)[:, -count:].astype("<f4").tobytes()

    def _refuse_while_streaming(self) -> None:
        """A subclass that streams raises ScpiError while it does."""
