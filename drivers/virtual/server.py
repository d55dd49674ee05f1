"""The pacing loop: one thread advances one source and serves all instruments of a rig."""

import select
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from drivers.virtual.faults import FaultPlan
from drivers.virtual.feed import SampleFeed
from recordings.run import SampleBlock

PACED_BLOCK_S = 0.02
IDLE_WAIT_S = 0.02
POLLED_WAIT_S = 0.001
LATE_LIMIT_S = 1.0


class VirtualDevice(Protocol):
    """What the loop needs of an instrument."""

    name: str

    @property
    def listening(self) -> bool:
        """Whether a client wants samples."""
        ...

    @property
    def has_room(self) -> bool:
        """Whether a block could be sent without waiting."""
        ...

    def accept(self, block: SampleBlock) -> None:
        """Take a block."""
        ...

    def end(self) -> None:
        """The source has come to its end."""
        ...

    def fail(self, reason: str) -> None:
        """The source has failed, and says why."""
        ...

    def service(self) -> bool:
        """Receive, answer, send, never wait; whether anything moved."""
        ...

    def descriptors(self) -> list[tuple[int, bool, bool]]:
        """Descriptors to wait for, whether for input, whether for room to write; -1 for what must be polled."""
        ...

    def close(self) -> None:
        """Let go of the line."""
        ...


class _Pace:
    """When the next block is due."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._start_s: float | None = None
        self.slips = 0

    def rest(self) -> None:
        """Nobody listens: time stands still."""
        self._start_s = None

    def wait_s(self, now_s: float, device_s: float) -> float:
        """Seconds until device time `device_s` may be reached."""
        due = device_s / self._speed
        if self._start_s is None:
            self._start_s = now_s - due
        left = self._start_s + due - now_s
        if left < -LATE_LIMIT_S:
            # The machine is too slow for this speed; do not try to make up for more than a moment.
            self.slips += 1
            self._start_s -= left
        return left


def serve(
    feed: SampleFeed,
    devices: Sequence[VirtualDevice],
    *,
    speed: float | None,
    faults: FaultPlan,
    stopping: Callable[[], bool],
    on_failure: Callable[[str], None] | None = None,
) -> int:
    """Serve until told to stop.

    The source advances only while a client listens: the rig rests between runs.  If it fails, the instruments stay
    and say so.

    Parameters
    ----------
    feed
        The source; flow-controlled if and only if `speed` is None.
    devices
        Instruments; they stay open.
    speed
        Multiple of real time, or None for as fast as the slowest client takes it, in which case nothing is lost.
    faults
        Faults of sensors, and of the lines by name of the device.
    stopping
        Asked at every turn, at least every 20 ms.
    on_failure
        Told in words when the source has failed.

    Returns
    -------
    int
        How often the machine was more than a second late for the wanted speed.
    """
    pace = _Pace(speed) if speed else None
    failed = False
    while not stopping():
        if bool(feed.failure) != failed:
            failed = not failed
            if failed:
                for device in devices:
                    device.fail(feed.failure)
                if on_failure is not None:
                    on_failure(feed.failure)
        moved = sum(device.service() for device in devices) > 0  # all of them, not the first that moved
        listening = [device for device in devices if device.listening]
        wait_s = IDLE_WAIT_S
        ready = bool(listening) and feed.may_advance
        longest = 1 << 20
        if pace is not None:
            if not listening:
                pace.rest()
            longest = max(30, int(feed.sample_rate_Hz * PACED_BLOCK_S * (speed or 1.0)))
            if ready:
                device_s = (feed.next_time_ns * 1e-9) + min(longest, feed.block_length) / feed.sample_rate_Hz
                wait_s = min(wait_s, pace.wait_s(time.monotonic(), device_s))
                ready = wait_s <= 0
        else:
            ready = ready and all(device.has_room for device in listening)
        if ready:
            block = feed.advance(longest)
            if block is not None:
                block = faults.spoil(block)
                for device in devices:
                    device.accept(block)
            if feed.finished:
                for device in devices:
                    device.end()
            continue
        if not moved:
            _wait(devices, max(0.0, wait_s))
    return pace.slips if pace is not None else 0


def _wait(devices: Sequence[VirtualDevice], longest_s: float) -> None:
    """Sleep until a descriptor is ready, or a polled bus is due."""
    poller = select.poll()
    for device in devices:
        for descriptor, read, write in device.descriptors():
            if descriptor >= 0:
                poller.register(descriptor, (select.POLLIN if read else 0) | (select.POLLOUT if write else 0))
            else:
                longest_s = min(longest_s, POLLED_WAIT_S if device.listening else 5 * POLLED_WAIT_S)
    poller.poll(1000 * longest_s)
