"""The two status groups that SCPI adds to IEEE 488.2: what an instrument is doing, and what to doubt in its data.

Each has a condition register, which is the present, an event register, which keeps every bit that came on until it is
read, and an enable register, which says which events show in the status byte (SCPI 1999, volume 1, chapter 9).
"""

MEASURING = 1 << 4
SAMPLES_LOST = 1 << 9
"""The first of the questionable group's bits that are left to the instrument."""
_BITS = 0x7FFF


class StatusGroup:
    """Condition, event and enable register."""

    def __init__(self) -> None:
        self.condition = 0
        self._events = 0
        self._enable = 0

    @property
    def enable(self) -> int:
        """Which events show in the status byte."""
        return self._enable

    @enable.setter
    def enable(self, value: int) -> None:
        self._enable = value & _BITS

    @property
    def summary(self) -> bool:
        """Whether an enabled event waits."""
        return bool(self._events & self._enable)

    def put(self, bit: int, on: bool) -> None:
        """Set a bit of the condition; that it came on is kept as an event."""
        if on:
            self._events |= bit & ~self.condition
            self.condition |= bit
        else:
            self.condition &= ~bit

    def take_events(self) -> int:
        """The event register, cleared by reading."""
        events, self._events = self._events, 0
        return events
