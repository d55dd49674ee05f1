"""The parser of SCPI: a program message to its units, compound headers, queries, strings (IEEE 488.2, chapter 7)."""

import re
from dataclasses import dataclass

from drivers.scpi.errors import ScpiError

_HEADER = re.compile(
    r"\s*(\*[A-Za-z]+\??|:?[A-Za-z][A-Za-z0-9_]*(?::[A-Za-z][A-Za-z0-9_]*)*\??)(?:\s+(.*)|\s*)\Z", re.S
)
_UNITS_LIMIT = 64


@dataclass(frozen=True, slots=True)
class Unit:
    """One command of a message: its full header in capitals and the texts of its parameters."""

    header: str
    arguments: list[str]


def parse_message(message: str) -> list[Unit | ScpiError]:
    """Units of one program message, in order; what cannot be read stands as its error, and nothing follows it.

    A header after ``;`` continues in the subsystem of the one before it, unless it starts with ``:`` or ``*``.
    """
    units: list[Unit | ScpiError] = []
    path = ""
    try:
        if not message.isascii() or any(ord(c) < 9 or 13 < ord(c) < 32 for c in message):
            raise ScpiError(-101)
        for text in _split(message, ";"):
            if not text.strip():
                continue
            if len(units) >= _UNITS_LIMIT:
                raise ScpiError(-363, f"more than {_UNITS_LIMIT} commands in one message")
            match = _HEADER.match(text)
            if match is None:
                raise ScpiError(-102, text.strip()[:40])
            header, rest = match[1].upper(), match[2]
            if header.startswith(":"):
                header = header[1:]
            elif not header.startswith("*"):
                header = path + header
            if not header.startswith("*"):
                path = header[: header.rfind(":") + 1]
            arguments = [part.strip() for part in _split(rest, ",")] if rest and rest.strip() else []
            if any(not argument for argument in arguments):
                raise ScpiError(-102, "an empty parameter")
            units.append(Unit(header, arguments))
    except ScpiError as error:
        units.append(error)
    return units


def _split(text: str, separator: str) -> list[str]:
    """Split at a separator that is not in quotes."""
    if '"' not in text and "'" not in text:
        return text.split(separator)
    parts, start, quote = [], 0, ""
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        elif c == separator:
            parts.append(text[start:i])
            start = i + 1
    if quote:
        raise ScpiError(-151, "a quote is not closed")
    return [*parts, text[start:]]
