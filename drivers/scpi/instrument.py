"""An SCPI instrument: the IEEE 488.2 common commands, the status registers, and the interpreter of its messages."""

import math
from collections import deque

from drivers.scpi.commands import Command, CommandTable, command, command_table
from drivers.scpi.errors import ScpiError
from drivers.scpi.parser import Unit, parse_message
from drivers.scpi.registers import Registers
from drivers.scpi.values import Integer, format_result

LINE_LIMIT = 4096
QUEUE_LIMIT = 256
MESSAGE_LIMIT = 1 << 20
"""Bytes of the answers of one message, unless it has a single one: what a client may make an instrument hold."""
OPERATION_COMPLETE = 1
STATUS_ERROR, STATUS_QUESTIONABLE, STATUS_MESSAGE = 4, 8, 16
STATUS_EVENT, STATUS_SERVICE, STATUS_OPERATION = 32, 64, 128
ENABLE_LIMIT = 65535


class Deferred:
    """The answer of a query that takes time: what comes after it waits until `result` is there."""

    def __init__(self) -> None:
        self.result: object = None
        self.done = False

    def finish(self, result: object) -> None:
        """Give the answer; an ScpiError is queued as an error instead."""
        self.result, self.done = result, True


class Instrument:
    """Registers, error queue and common commands; a subclass adds its own with :func:`drivers.scpi.command`."""

    identity = ("", "", "0", "0")

    def __init__(self) -> None:
        self.registers = Registers()
        """Those of the client whose command is being done."""

    @classmethod
    def table(cls) -> CommandTable:
        """The command table of the class, built once."""
        found = cls.__dict__.get("_table")
        if found is None:
            found = command_table(cls)
            cls._table = found  # type: ignore[attr-defined]
        assert isinstance(found, CommandTable)
        return found

    def admit(self, row: Command) -> None:
        """Called before every command; a subclass raises ScpiError if the client may not do it now."""

    def reset(self) -> None:
        """Settings to their defaults (``*RST``); a subclass overrides it."""

    def self_test(self) -> int:
        """0 if all is well (``*TST?``); a subclass may test something."""
        return 0

    def refresh_status(self) -> None:
        """Bring the conditions of the status groups up to date; a subclass knows them."""

    def end_message(self) -> None:
        """Called after the last command of a message; a subclass may apply what it has gathered."""

    @command("*IDN?")
    def _identify(self) -> str:
        """Maker, model, serial number, version."""
        return ",".join(self.identity)

    @command("*RST", controls=True)
    def _reset(self) -> None:
        """Settings to their defaults; registers and errors stay."""
        self.reset()

    @command("*CLS")
    def _clear(self) -> None:
        """Clear the error queue and the event registers."""
        self.registers.errors.clear()
        self.registers.events = 0
        self.registers.operation.take_events()
        self.registers.questionable.take_events()

    @command("*ESE", Integer(maximum=255))
    def _set_event_enable(self, value: int) -> None:
        """Which events show in bit 5 of the status byte."""
        self.registers.event_enable = value

    @command("*ESE?")
    def _get_event_enable(self) -> int:
        """The event enable register."""
        return self.registers.event_enable

    @command("*ESR?")
    def _take_events(self) -> int:
        """The event register, cleared by reading."""
        events, self.registers.events = self.registers.events, 0
        return events

    @command("*SRE", Integer(maximum=255))
    def _set_service_enable(self, value: int) -> None:
        """Which bits of the status byte request service."""
        self.registers.service_enable = value & ~STATUS_SERVICE

    @command("*SRE?")
    def _get_service_enable(self) -> int:
        """The service request enable register."""
        return self.registers.service_enable

    @command("*STB?")
    def _status(self) -> int:
        """The status byte: 4 errors, 8 questionable data, 16 an answer, 32 an event, 64 service, 128 operation."""
        self.refresh_status()
        shown = (
            (STATUS_ERROR, len(self.registers.errors) > 0),
            (STATUS_QUESTIONABLE, self.registers.questionable.summary),
            (STATUS_MESSAGE, self.registers.message_available),
            (STATUS_EVENT, bool(self.registers.events & self.registers.event_enable)),
            (STATUS_OPERATION, self.registers.operation.summary),
        )
        status = sum(bit for bit, on in shown if on)
        return status | (STATUS_SERVICE if status & self.registers.service_enable else 0)

    @command("*OPC")
    def _operation_complete(self) -> None:
        """Set bit 0 of the event register when all is done; commands run one after the other, so at once."""
        self.registers.events |= OPERATION_COMPLETE

    @command("*OPC?")
    def _is_operation_complete(self) -> int:
        """1 when all commands before it are done."""
        return 1

    @command("*WAI")
    def _wait(self) -> None:
        """Wait for the commands before it, which run one after the other anyway."""

    @command("*TST?")
    def _self_test(self) -> int:
        """Self test: 0 is passed."""
        return self.self_test()

    @command("SYSTem:ERRor[:NEXT]?")
    def _next_error(self) -> str:
        """The oldest error, taken out of the queue."""
        return self.registers.errors.pop().text

    @command("SYSTem:ERRor:COUNt?")
    def _error_count(self) -> int:
        """How many errors wait."""
        return len(self.registers.errors)

    @command("SYSTem:VERSion?")
    def _version(self) -> str:
        """The SCPI version followed."""
        return "1999.0"

    @command("STATus:OPERation[:EVENt]?")
    def _take_operation_events(self) -> int:
        """What came on since the last reading, cleared by it: 16 measuring."""
        self.refresh_status()
        return self.registers.operation.take_events()

    @command("STATus:OPERation:CONDition?")
    def _get_operation_condition(self) -> int:
        """What is on now, in the bits of the event register."""
        self.refresh_status()
        return self.registers.operation.condition

    @command("STATus:OPERation:ENABle", Integer(maximum=ENABLE_LIMIT))
    def _set_operation_enable(self, value: int) -> None:
        """Which of these events show in bit 7 of the status byte."""
        self.registers.operation.enable = value

    @command("STATus:OPERation:ENABle?")
    def _get_operation_enable(self) -> int:
        """The enable register."""
        return self.registers.operation.enable

    @command("STATus:QUEStionable[:EVENt]?")
    def _take_questionable_events(self) -> int:
        """What came on since the last reading, cleared by it: 512 samples were lost."""
        self.refresh_status()
        return self.registers.questionable.take_events()

    @command("STATus:QUEStionable:CONDition?")
    def _get_questionable_condition(self) -> int:
        """What is on now, in the bits of the event register."""
        self.refresh_status()
        return self.registers.questionable.condition

    @command("STATus:QUEStionable:ENABle", Integer(maximum=ENABLE_LIMIT))
    def _set_questionable_enable(self, value: int) -> None:
        """Which of these events show in bit 3 of the status byte."""
        self.registers.questionable.enable = value

    @command("STATus:QUEStionable:ENABle?")
    def _get_questionable_enable(self) -> int:
        """The enable register."""
        return self.registers.questionable.enable

    @command("STATus:PRESet")
    def _preset(self) -> None:
        """No operation or questionable event shows in the status byte."""
        self.registers.operation.enable = self.registers.questionable.enable = 0

    @command("SYSTem:HELP:HEADers?")
    def _help(self) -> bytes:
        """The command table, as a definite-length block."""
        return self.table().describe().encode()


class Interpreter:
    """One client's conversation: bytes in, replies out, in order, one command at a time."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self.registers = Registers()
        self._line = bytearray()
        self._overlong = False
        self._units: deque[Unit | ScpiError | None] = deque()  # None ends a message
        self._answers: list[bytes] = []
        self._answered = 0
        self._waiting: Deferred | None = None

    @property
    def room(self) -> bool:
        """Whether more input should be taken."""
        return len(self._units) < QUEUE_LIMIT

    def feed(self, data: bytes) -> None:
        """Take bytes from the client; lines end with LF, CR LF or, as a terminal sends, CR; too long is error -363."""
        *lines, rest = data.replace(b"\r", b"\n").split(b"\n")
        for line in lines:
            self._line += line
            if self._overlong or len(self._line) > LINE_LIMIT:
                self._units.append(ScpiError(-363, f"a line of more than {LINE_LIMIT} bytes"))
            else:
                self._units.extend(parse_message(self._line.decode("latin-1")))
            self._units.append(None)
            self._line.clear()
            self._overlong = False
        self._line += rest
        if len(self._line) > LINE_LIMIT:
            self._line.clear()
            self._overlong = True

    @property
    def busy(self) -> bool:
        """Whether there is something left to do, or an answer to wait for."""
        return bool(self._units) or self._waiting is not None

    def run(self, *, messages: float = math.inf, room: float = math.inf) -> list[bytes]:
        """Do what can be done now; the replies, one a message, each ending with a newline.

        Parameters
        ----------
        messages
            To do at most: what one client sends must not keep the others waiting.
        room
            Bytes of replies after which the rest is left for later.
        """
        self._instrument.registers = self.registers
        replies = []
        while messages > 0 and room > 0:
            if self._waiting is not None:
                if not self._waiting.done:
                    break
                result, self._waiting = self._waiting.result, None
                self._answer(result)
            if not self._units:
                break
            unit = self._units.popleft()
            if unit is None:
                messages -= 1
                self._instrument.end_message()
                if self._answers:
                    replies.append(b";".join(self._answers) + b"\n")
                    room -= len(replies[-1])
                    self._answers.clear()
                    self._answered = 0
            elif isinstance(unit, ScpiError):
                self.registers.report(unit)
            else:
                self._execute(unit)
        return replies

    def _execute(self, unit: Unit) -> None:
        try:
            found, suffixes = self._instrument.table().find(unit.header)
            self.registers.message_available = bool(self._answers)
            self._instrument.admit(found)
            result = found.call(self._instrument, suffixes, unit.arguments)
        except ScpiError as error:
            result = error
        if isinstance(result, Deferred):
            self._waiting = result
        else:
            self._answer(result)

    def _answer(self, result: object) -> None:
        if isinstance(result, ScpiError):
            self.registers.report(result)
        elif result is not None:
            answer = format_result(result)
            self._answered += len(answer)
            if self._answers and self._answered > MESSAGE_LIMIT:
                self.registers.report(ScpiError(-430, f"answers of one message beyond {MESSAGE_LIMIT} bytes"))
                self._answers.clear()
                self._answered = 0
            else:
                self._answers.append(answer)
