"""CSV of any dialect: delimiter, decimal sign, encoding, head lines and a line of units are found in the text."""

import codecs
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow
from pyarrow import csv

from recordings.errors import InputError
from recordings.importing.labels import split_label, unit_known
from recordings.importing.mapping import Mapping
from recordings.importing.signals import Signal, check_size
from recordings.reader import open_input

SIZE_LIMIT_BYTES = 2 << 30
HEAD_BYTES = 1 << 16
"""In which the first lines of numbers are looked for."""
DIALECTS = [(cut, point) for cut in ("\t", ";", ",", "|", " ") for point in (".", ",") if cut != point]
"""Delimiter and decimal sign; a blank stands for any white space.  Of two that fit equally the first is taken."""
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_TIME = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?Z?")
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "#N/A", "null", "-"]
_RATE = re.compile(
    r"(?:sampl\w*[ _]*(?:rate|freq\w*)|abtastrate|\bfs\b)"
    r"[^0-9]{0,20}?([0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]+)?)\s*(k?)",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class _Dialect:
    """How lines are cut into cells, and where the numbers begin."""

    delimiter: str
    decimal: str
    first: int
    columns: int

    def cells(self, line: str) -> list[str]:
        """The cells of a line, without quotes."""
        cells = line.split() if self.delimiter == " " else line.split(self.delimiter)
        return [cell.strip().strip('"').strip() for cell in cells]


def read_delimited(path: Path, mapping: Mapping) -> list[Signal]:
    """Columns of a text file.

    Raises
    ------
    InputError
        With line and column, if there are no numbers in columns, or something else among them.
    """
    with open_input(path) as stream:
        data = stream.read(SIZE_LIMIT_BYTES + 1)
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for text")
    text = _decoded(path, data)
    head = text[:HEAD_BYTES].splitlines()
    if len(text) > HEAD_BYTES:
        head.pop()
    if head and head[0].startswith("# rig run"):
        raise InputError(path, "", "is a recording already", "'twin convert' reads it")
    dialect = _dialect(head, mapping)
    if dialect is None:
        raise InputError(path, "", "has no lines of numbers in columns", "say delimiter and decimal in a --mapping")
    names, units = _head(head[: dialect.first], dialect)
    check_size(path, "", dialect.columns * text.count("\n"), dialect.columns)
    rate = _rate(head[: dialect.first])
    table = _table(path, text, dialect, names, head[dialect.first])
    signals = []
    for name, unit, column in zip(names, units, table.columns, strict=True):
        values = _values(column)
        if values is not None and not (name.startswith("column_") and np.all(np.isnan(values))):
            signals.append(Signal(name=name, unit=unit, values=values, table="", sample_rate_Hz=rate))
    return signals


def _decoded(path: Path, data: bytes) -> str:
    encodings = ["utf-16"] if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(path, "", "is no text", "the suffix should say what the file is")


def _numeric(cell: str, decimal: str) -> bool:
    return bool(_NUMBER.fullmatch(cell.replace(",", ".") if decimal == "," else cell))


def _dialect(head: list[str], mapping: Mapping) -> _Dialect | None:
    """The dialect in which most cells of the last lines are numbers; None if there is none."""
    best, most = None, 0
    for delimiter, decimal in DIALECTS:
        if mapping.delimiter not in (None, delimiter) or mapping.decimal not in (None, decimal):
            continue
        dialect = _Dialect(delimiter, decimal, 0, 0)
        rows = [dialect.cells(line) for line in head]
        counts = [len(row) for row in rows[-50:] if any(row)]
        columns = max(set(counts), key=counts.count, default=0)
        numbers = [[_numeric(cell, decimal) for cell in row] if len(row) == columns else [] for row in rows]
        tail = [row for row in numbers[-50:] if row]
        score = sum(map(sum, tail))
        if score <= most:
            continue
        usual = np.mean(tail, axis=0) > 0.5
        first = next(n for n, row in enumerate(numbers) if row and np.sum(row) >= max(1, np.sum(usual) - 1))
        best, most = _Dialect(delimiter, decimal, first, columns), score
    return best


def _head(lines: list[str], dialect: _Dialect) -> tuple[list[str], list[str]]:
    """Names and units of the columns, from the line above the numbers or the two lines above them."""
    rows = [dialect.cells(line.lstrip("#%/ ")) for line in lines if line.strip()]
    rows = [row for row in rows[-2:] if len(row) == dialect.columns]
    units = [""] * dialect.columns
    if len(rows) == 2 and all(not cell or unit_known(cell.strip("[](){}")) for cell in rows[1]) and any(rows[1]):
        units = [cell.strip("[](){}") for cell in rows.pop()]
    labels = [split_label(label) for label in rows[-1]] if rows else [("", "")] * dialect.columns
    names: list[str] = []
    for at, (name, _) in enumerate(labels, start=1):
        name = name or f"column_{at}"
        names.append(f"{name}_{at}" if name in names else name)
    return names, [unit or own for unit, (_, own) in zip(units, labels, strict=True)]


def _rate(lines: list[str]) -> float | None:
    """A sample rate that the head lines say, Hz."""
    found = next((found for line in lines if (found := _RATE.search(line))), None)
    return float(found[1].replace(",", ".")) * (1e3 if found[2] else 1.0) if found else None


def _table(path: Path, text: str, dialect: _Dialect, names: list[str], sample: str) -> pyarrow.Table:
    """All numbers, by pyarrow; raises InputError with the line of what is none."""
    body = text.split("\n", dialect.first)[-1] if dialect.first else text
    delimiter = dialect.delimiter
    if delimiter == " ":
        delimiter, body = "\t", re.sub(r"[ \t]+", "\t", re.sub(r"(?m)^[ \t]+|[ \t]+$", "", body))
    numeric = [_numeric(cell, dialect.decimal) or not cell for cell in dialect.cells(sample)]
    types = [pyarrow.float64() if each else pyarrow.string() for each in numeric]
    keys = [str(at) for at in range(len(names))]
    try:
        return csv.read_csv(
            io.BytesIO(body.encode()),
            csv.ReadOptions(use_threads=False, column_names=keys),
            csv.ParseOptions(delimiter=delimiter),
            csv.ConvertOptions(
                column_types=dict(zip(keys, types, strict=True)), decimal_point=dialect.decimal, null_values=_MISSING
            ),
        )
    except pyarrow.ArrowInvalid as error:
        raise _refusal(path, str(error), dialect, names) from error


def _refusal(path: Path, told: str, dialect: _Dialect, names: list[str]) -> InputError:
    """What pyarrow says of a row, by the line of the file."""
    row, column, value = (re.search(what, told) for what in (r"Row #(\d+)", r"column #(\d+)", r"invalid value '(.*)'"))
    line = f"line {dialect.first + int(row[1])}" if row else ""
    if value is None:
        counts = re.search(r"Expected (\d+) columns, got (\d+)", told)
        reason = f"has {counts[2]} columns, the lines before it {counts[1]}" if counts else told[:120]
        return InputError(path, line, reason)
    name = f"column {names[int(column[1])]!r:.60}" if column else ""
    return InputError(path, ", ".join(filter(None, (line, name))), f"{value[1]!r:.40} is not a number")


def _values(column: pyarrow.ChunkedArray) -> np.ndarray | None:
    """Numbers, or times from text; None for other text."""
    if pyarrow.types.is_floating(column.type):
        return np.asarray(column.to_numpy(), dtype=np.float64)
    texts = column.to_pylist()
    if texts and all(text is not None and _TIME.fullmatch(text.strip()) for text in texts):
        return np.array([text.strip().removesuffix("Z") for text in texts], dtype="datetime64[ns]")
    return None
