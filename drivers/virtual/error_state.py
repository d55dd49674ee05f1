"""Fault confinement of a CAN controller (ISO 11898-1): who disturbs the bus too often must leave it."""

import time
from enum import IntEnum

RESTART_S = 0.1
"""From bus-off to the next attempt; the 128 times 11 free bits that the standard asks for take less."""


class ErrorState(IntEnum):
    """How far a controller has come on its way off the bus; the values are those in the heartbeat."""

    ACTIVE = 0
    PASSIVE = 1
    BUS_OFF = 2


class ErrorCounter:
    """The transmit error count of one controller: eight up for each failed frame, one down for each good one."""

    def __init__(self) -> None:
        self._count = 0
        self._off_until = 0.0
        self._worst = ErrorState.ACTIVE

    @property
    def state(self) -> ErrorState:
        """The state now."""
        if time.monotonic() < self._off_until:
            return ErrorState.BUS_OFF
        return ErrorState.PASSIVE if self._count > 127 else ErrorState.ACTIVE

    def fail(self) -> None:
        """A frame was destroyed on the bus."""
        self._count += 8
        if self._count > 255:
            self._count = 0
            self._off_until = time.monotonic() + RESTART_S
        self._worst = max(self._worst, self.state)

    def succeed(self) -> None:
        """A frame got through."""
        self._count = max(0, self._count - 1)

    def take_worst(self) -> ErrorState:
        """The worst state since the last call: while off the bus nobody can be told."""
        worst, self._worst = max(self._worst, self.state), self.state
        return worst
