"""Device clocks brought to one time base by pulses that every device stamps with its own clock."""

from bisect import bisect_right

import numpy as np

STAMP_ROUNDING_NS = 1.5
PAIRS = 600
"""Pulses in the fit: a minute at one every 100 ms."""


class ClockFit:
    """Offset and drift between a device's clock and the reference's.

    The times of the same pulses are fitted by a straight line, least squares over the latest minute.
    """

    def __init__(self) -> None:
        self._reference: dict[int, int] = {}
        self._local: dict[int, int] = {}
        self._pairs = np.zeros((2, PAIRS), np.int64)  # local time, reference minus local; the oldest is overwritten
        self._count = 0
        self._fitted = True
        self._origin_ns = 0
        self._offset_ns = 0.0
        self._drift = 0.0

    @property
    def drift_ppm(self) -> float:
        """How much faster the reference runs."""
        self._fit()
        return 1e6 * self._drift

    @property
    def offset_ns(self) -> float:
        """How far the reference is ahead, at the latest pulse."""
        self._fit()
        return self._offset_ns

    @property
    def synchronised(self) -> bool:
        """Whether a pulse was seen by both."""
        return self._count > 0

    def add_reference(self, pulse: int, time_ns: int) -> None:
        """The reference saw a pulse."""
        self._match(self._reference, self._local, pulse, time_ns)

    def add_local(self, pulse: int, time_ns: int) -> None:
        """The device saw a pulse."""
        self._match(self._local, self._reference, pulse, time_ns)

    def _match(self, mine: dict[int, int], other: dict[int, int], pulse: int, time_ns: int) -> None:
        mine[pulse] = time_ns
        if pulse in other:
            local, reference = self._local.pop(pulse), self._reference.pop(pulse)
            self._pairs[:, self._count % PAIRS] = local, reference - local
            self._count += 1
            self._fitted = False
        while len(mine) > PAIRS:  # the other one has missed them
            del mine[next(iter(mine))]

    def _fit(self) -> None:
        """Straight line through the pairs, if there are new ones."""
        if self._fitted:
            return
        self._fitted = True
        local, difference = self._pairs[:, : self._count]
        latest = (self._count - 1) % PAIRS
        self._origin_ns, base = int(local[latest]), int(difference[latest])
        spread = difference - base
        self._offset_ns, self._drift = float(base), 0.0
        if spread.any():
            elapsed = (local - self._origin_ns).astype(float)
            self._drift, intercept = np.polyfit(elapsed, spread.astype(float), 1)
            self._offset_ns = base + intercept

    def to_reference(self, time_ns: int) -> int:
        """A time of the device in the reference's clock."""
        self._fit()
        return time_ns + round(self._offset_ns + self._drift * (time_ns - self._origin_ns))


class TimeLine:
    """When each sample of a device was taken, from time stamps of some of them."""

    def __init__(self) -> None:
        self._indices: list[int] = []
        self._times_ns: list[int] = []

    def add(self, index: int, time_ns: int) -> None:
        """Sample `index` was taken at `time_ns`; later indices only, others are ignored."""
        if not self._indices or index > self._indices[-1]:
            self._indices.append(index)
            self._times_ns.append(time_ns)

    def time_ns(self, index: int, sample_rate_Hz: float) -> int:
        """Time of a sample, counted from the stamp before it.

        The spacing is the rate's, unless the stamps around it (or the latest two) say otherwise by more than their
        rounding: the clock that stamps need not be the one that samples.
        """
        if not self._indices:
            return round(index * 1e9 / sample_rate_Hz)
        at = max(0, bisect_right(self._indices, index) - 1)
        spacing_ns = 1e9 / sample_rate_Hz
        before = min(at, len(self._indices) - 2)
        if before >= 0:
            steps = self._indices[before + 1] - self._indices[before]
            measured_ns = self._times_ns[before + 1] - self._times_ns[before]
            if abs(measured_ns - steps * spacing_ns) > STAMP_ROUNDING_NS:
                spacing_ns = measured_ns / steps
        return self._times_ns[at] + round((index - self._indices[at]) * spacing_ns)

    def forget_before(self, index: int) -> None:
        """Samples before this one are not asked for any more."""
        at = max(0, bisect_right(self._indices, index) - 2)  # two are needed to go on with
        del self._indices[:at]
        del self._times_ns[:at]
