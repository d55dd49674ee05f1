"""Numbers in text: many at once, and those of old formats."""

import io
import re
from pathlib import Path

import numpy as np

from recordings.errors import InputError
from twin.arrays import Array

_BARE_EXPONENT = re.compile(r"(?<=[0-9.])(?=[+-])")


def fortran_number(text: str) -> float:
    """A number as Fortran programs write it: also 1.5D+03, and 1.5+3 without a letter; ValueError if it is none."""
    plain = text.strip().upper().replace("D", "E")
    return float(plain if "E" in plain else _BARE_EXPONENT.sub("E", plain, count=1))


def number_table(path: Path, data: bytes, *, columns: int) -> Array:
    """Numbers between spaces or commas, (lines, columns); empty lines and those that begin with ``**`` are left out.

    InputError with the line, if it has another number of values, or a value is no number.
    """
    plain = data.translate(bytes.maketrans(b",Dd", b" Ee")).replace(b"**", b"#")
    try:
        table = np.loadtxt(io.BytesIO(plain), dtype=float, comments="#", ndmin=2)
        if table.shape[1] == columns:
            return table
    except ValueError:
        pass
    for line, text in enumerate(plain.splitlines(), 1):
        values = text.partition(b"#")[0].split()
        if values and len(values) != columns:
            reason = f"has {len(values)} values where {columns} are expected"
            raise InputError(path, f"line {line}", reason, "export it again")
        for value in values:
            try:
                float(value)
            except ValueError:
                word = value[:30].decode("latin-1")
                raise InputError(path, f"line {line}", f"{word!r} is not a number", "export it again") from None
    raise InputError(path, "", "holds no numbers", "export it again")


def whole_numbers(path: Path, values: Array, what: str) -> Array:
    """The same as integers; InputError if one is not a whole number of less than 16 digits."""
    good = np.isfinite(values) & (np.abs(values) < 1e15) & (values == np.floor(values))
    if not np.all(good):
        row = int(np.argmin(good.reshape(len(values), -1).all(axis=1)))
        raise InputError(path, f"entry {row + 1}", f"{what} is not a whole number", "export it again")
    return values.astype(np.int64)
