"""What an instrument keeps for one client: its errors, the events it has not read yet, what it wants to be told."""

from drivers.scpi.errors import ErrorQueue, ScpiError
from drivers.scpi.status import StatusGroup

QUERY_ERROR, DEVICE_ERROR, EXECUTION_ERROR, COMMAND_ERROR, POWER_ON = 4, 8, 16, 32, 128
_EVENT_OF_CLASS = {1: COMMAND_ERROR, 2: EXECUTION_ERROR, 3: DEVICE_ERROR, 4: QUERY_ERROR}
"""Bit of the event register by the hundreds of an error's number (SCPI 1999, volume 2, 21.8)."""


class Registers:
    """Error queue, event and enable registers of one client, as after power-up."""

    def __init__(self) -> None:
        self.errors = ErrorQueue()
        self.events = POWER_ON
        self.event_enable = 0
        self.service_enable = 0
        self.operation = StatusGroup()
        self.questionable = StatusGroup()
        self.message_available = False

    def report(self, error: ScpiError) -> None:
        """Queue an error and set its bit in the event register."""
        self.errors.push(error)
        self.events |= _EVENT_OF_CLASS.get(-error.number // 100, 0)
