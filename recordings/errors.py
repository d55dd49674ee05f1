"""The one error a user sees: which file, where in it, why, and what to do."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def printable(text: str) -> str:
    """`text` with what could steer a terminal, but for the ends of its lines, as question marks."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)


class InputError(Exception):
    """Bad input from a person or another program; the command line prints it as one line and exits with 2.

    Parameters
    ----------
    source
        File, address or option the input came from.
    place
        Where in it: a field such as ``joint.overlap``, a line, a record, a channel; empty if the whole of it.
    reason
        What is wrong, with the offending value.
    remedy
        What the user can do about it; empty if the reason says it.
    """

    def __init__(self, source: str | Path, place: str, reason: str, remedy: str = "") -> None:
        self.source, self.place, self.reason, self.remedy = str(source), place, reason, remedy
        super().__init__(str(self))

    def __str__(self) -> str:
        head = f"{self.source}: {self.place}: {self.reason}" if self.place else f"{self.source}: {self.reason}"
        line = f"{head}; {self.remedy}" if self.remedy else head
        return printable(" ".join(line.split()))


def reason_of(error: OSError) -> str:
    """What the system says hindered it, as the middle of a sentence."""
    return (error.strerror or str(error)).lower()


@contextmanager
def blamed_on(
    source: str | Path, place: str = "", remedy: str = "", *,
    of: type[Exception] | tuple[type[Exception], ...] = ValueError,
) -> Iterator[None]:  # fmt: skip
    """Turn an error from within, `of` this kind or of these, into an :class:`InputError` with its text."""
    try:
        yield
    except of as error:
        raise InputError(source, place, str(error), remedy) from error
