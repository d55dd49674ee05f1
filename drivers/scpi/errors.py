"""SCPI errors with their standard numbers, and the queue they wait in."""

from collections import deque

STANDARD_MESSAGES = {
    0: "No error",
    -100: "Command error",
    -101: "Invalid character",
    -102: "Syntax error",
    -104: "Data type error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -113: "Undefined header",
    -114: "Header suffix out of range",
    -120: "Numeric data error",
    -131: "Invalid suffix",
    -138: "Suffix not allowed",
    -141: "Invalid character data",
    -151: "Invalid string data",
    -200: "Execution error",
    -203: "Command protected",
    -213: "Init ignored",
    -221: "Settings conflict",
    -222: "Data out of range",
    -224: "Illegal parameter value",
    -241: "Hardware missing",
    -300: "Device-specific error",
    -350: "Queue overflow",
    -363: "Input buffer overrun",
    -410: "Query INTERRUPTED",
    -430: "Query DEADLOCKED",
}
"""Messages of SCPI 1999, volume 2, chapter 21."""


class ScpiError(Exception):
    """A command that cannot be done; `number` is the standard's."""

    def __init__(self, number: int, detail: str = "") -> None:
        self.number, self.detail = number, detail
        super().__init__(self.text)

    @property
    def text(self) -> str:
        """The error as ``SYSTem:ERRor?`` gives it, at most 255 characters in the quotes."""
        message = STANDARD_MESSAGES[self.number] + (f";{self.detail}" if self.detail else "")
        printable = "".join(c if c.isprintable() and c.isascii() and c != '"' else "?" for c in message)
        return f'{self.number},"{printable[:255]}"'


class ErrorQueue:
    """First in, first out; when it is full the last entry becomes -350."""

    def __init__(self, capacity: int = 16) -> None:
        self._capacity = capacity
        self._errors: deque[ScpiError] = deque()

    def __len__(self) -> int:
        return len(self._errors)

    def push(self, error: ScpiError) -> None:
        """Add an error."""
        if len(self._errors) >= self._capacity:
            self._errors[-1] = ScpiError(-350)
        else:
            self._errors.append(error)

    def pop(self) -> ScpiError:
        """Take the oldest error; number 0 if there is none."""
        return self._errors.popleft() if self._errors else ScpiError(0)

    def clear(self) -> None:
        """Forget all of them."""
        self._errors.clear()
