"""How long a frame occupies a CAN bus: no software bus enforces it, so the node does, or a rehearsal would lie."""

import time

STUFFING = 1.1
_NOMINAL_BITS = 17 + 12
"""Start to bit-rate switch; acknowledge, end of frame and the gap to the next one."""
_DATA_BITS = 1 + 4 + 4 + 1
"""Error-state indicator, length code, stuff count, CRC delimiter."""
_CLASSIC_BITS = 1 + 11 + 3 + 4 + 15 + 3 + 7 + 3
"""Start, identifier, flags, length code, CRC, its delimiter with the acknowledgement, end of frame, gap."""


def frame_seconds(data_bytes: int, *, bitrate: float, data_bitrate: float) -> float:
    """Time of one frame with an 11-bit identifier, with a tenth of its bits stuffed (ISO 11898-1)."""
    checksum = 17 + 5 if data_bytes <= 16 else 21 + 6  # with its fixed stuff bits
    data_phase = _DATA_BITS + 8 * data_bytes + checksum
    return STUFFING * (_NOMINAL_BITS / bitrate + data_phase / data_bitrate)


def classic_frame_seconds(data_bytes: int, *, bitrate: float) -> float:
    """Time of one classic frame with an 11-bit identifier, with a tenth of its bits stuffed (ISO 11898-1)."""
    return STUFFING * (_CLASSIC_BITS + 8 * data_bytes) / bitrate


class BusTime:
    """Lets frames through as fast as the bit rates allow, and the frames of others.

    A process may be kept waiting by the machine, a bus is not: while frames wait, all time that has passed is theirs,
    however late the node is called.

    Parameters
    ----------
    bitrate, data_bitrate
        Of the arbitration and of the data phase, bit/s.
    multiple
        Of real time; None for a bus without limit.
    is_fd
        Whether the node's frames are those of CAN FD, or classic ones.
    """

    def __init__(
        self, *, bitrate: float = 1e6, data_bitrate: float = 5e6, multiple: float | None = None, is_fd: bool = True
    ) -> None:
        self._seconds_of = {
            True: [frame_seconds(size, bitrate=bitrate, data_bitrate=data_bitrate) for size in range(65)],
            False: [classic_frame_seconds(size, bitrate=bitrate) for size in range(9)],
        }
        self._seconds = self._seconds_of[is_fd]
        self._multiple = multiple
        self._busy_s = 0.0
        self._since = time.monotonic()
        self._free_at = self._since * (multiple or 0.0)

    def frame_s(self, data_bytes: int) -> float:
        """How long a frame takes."""
        return self._seconds[data_bytes]

    @property
    def is_free(self) -> bool:
        """Whether a frame may be sent now."""
        return self._multiple is None or self._free_at <= time.monotonic() * self._multiple

    def take(self, data_bytes: int) -> None:
        """The bus is taken for the time that a frame needs."""
        self._free_at += self._seconds[data_bytes]
        self._busy_s += self._seconds[data_bytes]

    def idle(self) -> None:
        """No frame has been waiting here until now."""
        if self._multiple is not None:
            self._free_at = max(self._free_at, time.monotonic() * self._multiple)

    def hear(self, data_bytes: int, *, is_fd: bool, waits: bool) -> None:
        """Another participant's frame has had the bus; what is sent here waits for it, unless it would have won.

        A software bus delivers frames at once, so that one with the higher identifier, which on a wire has to wait
        for those that are due here, comes too early: then it only counts to the load.
        """
        if self._multiple is None:
            return
        table = self._seconds_of[is_fd]
        seconds = table[min(data_bytes, len(table) - 1)]  # a software bus takes classic frames of any length
        self._busy_s += seconds
        if waits:
            self._free_at += seconds

    def take_load(self) -> float | None:
        """The part of the time since the last call in which the bus was busy; None for one without limit."""
        if self._multiple is None:
            return None
        now = time.monotonic()
        elapsed_s = max(1e-3, (now - self._since) * self._multiple)
        load, self._busy_s, self._since = self._busy_s / elapsed_s, 0.0, now
        return min(1.0, load)
