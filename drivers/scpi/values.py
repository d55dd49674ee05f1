"""Parameters of SCPI commands: numbers with units, words, switches; and how results are written."""

import math
import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drivers.scpi.errors import ScpiError

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:\s*[eE]\s*[+-]?\d+)?)\s*([A-Za-z%/]*)\s*\Z")
_PREFIXES = {
    "EX": 1e18, "PE": 1e15, "T": 1e12, "G": 1e9, "MA": 1e6, "K": 1e3, "": 1.0,
    "M": 1e-3, "U": 1e-6, "N": 1e-9, "P": 1e-12, "F": 1e-15, "A": 1e-18,
}  # fmt: skip


def short_form(name: str) -> str:
    """The capitals of a mnemonic: ``SINusoid`` gives ``SIN``."""
    return "".join(c for c in name if not c.islower())


class Parameter(Protocol):
    """What a command accepts at one place."""

    def parse(self, text: str) -> object:
        """The value of a parameter's text; raises ScpiError."""
        ...

    def describe(self) -> str:
        """For the command table."""
        ...


@dataclass(frozen=True, kw_only=True)
class Number:
    """A decimal number with an optional unit; MINimum and MAXimum stand for the limits."""

    minimum: float = -math.inf
    maximum: float = math.inf
    unit: str = ""

    def parse(self, text: str) -> float:
        """Value in the base unit."""
        limit = self._named_limit(text)
        if limit is not None:
            return limit
        match = _NUMBER.match(text)
        if match is None:
            raise ScpiError(-104, f"{text.strip()[:40]} is not a number")
        try:
            value = float(re.sub(r"\s", "", match[1])) * self._factor(match[2].upper())
        except (OverflowError, ValueError) as error:
            raise ScpiError(-120, text.strip()[:40]) from error
        if not self.minimum <= value <= self.maximum:
            raise ScpiError(-222, f"{value:g} is not in {self.minimum:g} to {self.maximum:g} {self.unit}".strip())
        return value

    def limit(self, text: str) -> float:
        """The limit that MINimum or MAXimum names; raises ScpiError for other words."""
        limit = self._named_limit(text)
        if limit is None:
            raise ScpiError(-224, f"{text.strip()[:40]} is neither MINimum nor MAXimum")
        return limit

    def _named_limit(self, text: str) -> float | None:
        word = text.strip().upper()
        for name, limit in (("MINIMUM", self.minimum), ("MAXIMUM", self.maximum)):
            if word in (name, name[:3]):
                return limit
        return None

    def _factor(self, suffix: str) -> float:
        if not suffix:
            return 1.0
        if not self.unit:
            raise ScpiError(-138, suffix)
        unit = self.unit.upper()
        if unit == "HZ" and suffix == "MHZ":  # IEEE 488.2, 7.7.3: the one unit whose M is mega
            return 1e6
        if not suffix.endswith(unit) or suffix[: -len(unit)] not in _PREFIXES:
            raise ScpiError(-131, f"{suffix} is not {self.unit}")
        return _PREFIXES[suffix[: -len(unit)]]

    def describe(self) -> str:
        """Range and unit."""
        return f"<{self.minimum:g} to {self.maximum:g}{' ' + self.unit if self.unit else ''}>"


@dataclass(frozen=True, kw_only=True)
class Integer:
    """A whole number."""

    minimum: int = 0
    maximum: int = 2**63 - 1

    def parse(self, text: str) -> int:
        """Its value; a fraction is rounded, as the standard wants."""
        word = text.strip()
        if word.isascii() and word.isdigit() and len(word) < 20:
            value = int(word)
        else:
            number = Number(minimum=-1e18, maximum=1e18).parse(text)
            value = round(number)
        if not self.minimum <= value <= self.maximum:
            raise ScpiError(-222, f"{value} is not in {self.minimum} to {self.maximum}")
        return value

    def describe(self) -> str:
        """Range."""
        return f"<{self.minimum} to {self.maximum}>"


@dataclass(frozen=True)
class Choice:
    """One of some mnemonics; gives its short form."""

    names: tuple[str, ...]

    def parse(self, text: str) -> str:
        """Short form of the chosen name."""
        word = text.strip().upper()
        for name in self.names:
            if word in (name.upper(), short_form(name)):
                return short_form(name)
        if not re.fullmatch(r"[A-Z][A-Z0-9_]*", word):
            raise ScpiError(-104, text.strip()[:40])
        raise ScpiError(-224, f"{word[:40]} is not one of {' '.join(self.names)}")

    def describe(self) -> str:
        """The names."""
        return "|".join(self.names)


@dataclass(frozen=True)
class Boolean:
    """``ON``, ``OFF`` or a number."""

    def parse(self, text: str) -> bool:
        """Whether it is on."""
        word = text.strip().upper()
        if word in ("ON", "OFF"):
            return word == "ON"
        return Integer(minimum=-(2**63)).parse(text) != 0

    def describe(self) -> str:
        """The words."""
        return "ON|OFF|1|0"


def definite_block(data: bytes) -> bytes:
    """Definite-length arbitrary block of IEEE 488.2: ``#`` digits length data."""
    length = str(len(data)).encode()
    return b"#%d%s%s" % (len(length), length, data)


def quoted(text: str) -> str:
    """String response data of IEEE 488.2: in double quotes, printable ASCII."""
    return '"' + "".join("'" if c == '"' else c if c.isprintable() and c.isascii() else "?" for c in text) + '"'


def format_result(value: object) -> bytes:
    """What a query's value looks like on the line."""
    if isinstance(value, bytes):
        return definite_block(value)
    if isinstance(value, (bool, np.bool_)):
        return b"1" if value else b"0"
    if isinstance(value, float):
        return repr(value).upper().encode() if math.isfinite(value) else b"9.91E37"
    if isinstance(value, tuple):
        return b",".join(format_result(item) for item in value)
    return str(value).encode("ascii", "replace")
