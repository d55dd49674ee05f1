"""Runs as CSV: comment lines of metadata, then one wide table a device.

The file begins with ``# rig run `` and a JSON object (metadata, steps, events, attachments).  Each device follows as
``# device `` and its name, a line of column names ``number,time_ns,<channel> [<unit>],...`` and a row a sample, in
order.  A sample that was lost has no row: its number is missing.  Values are the shortest decimals that give the
same float32 again; a channel that a device did not send at that time is empty.
"""

import csv
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn, TextIO

import numpy as np

from recordings.convert.blocks import blocks_of, device_from_rows, to_float32
from recordings.convert.description import Description, describe, parse_description
from recordings.errors import InputError, blamed_on, reason_of
from recordings.reader import open_input
from recordings.run import DeviceSamples, Run

_HEAD, _DEVICE = "# rig run ", "# device "
LINE_LIMIT, HEAD_LIMIT, ROW_LIMIT = 1 << 20, 128 << 20, 1 << 27
"""Characters of a row and of the metadata, rows of a device."""


def write_csv(run: Run, path: Path) -> list[str]:
    """Write all of a run; nothing is left behind."""
    with path.open("x", encoding="utf-8", newline="") as stream:
        stream.write(_HEAD + json.dumps(describe(run), ensure_ascii=False) + "\n")
        for name, device in run.devices.items():
            stream.write(f"{_DEVICE}{json.dumps(name)}\n")
            writer = csv.writer(stream, lineterminator="\n")
            units = [f"{channel} [{run.channels[channel].unit}]" for channel in device.values]
            writer.writerow(["number", "time_ns", *units])
            for block in blocks_of(device):
                number = np.arange(len(block)) + block.first_index
                time_ns = block.time_ns + np.rint(np.arange(len(block)) * (1e9 / device.sample_rate_Hz)).astype(int)
                with np.printoptions(legacy=False):  # some packages set it for all when imported: six digits are left
                    columns = [np.where(np.isnan(v), "", v.astype(str)) for v in block.samples.values()]
                writer.writerows(zip(number.tolist(), time_ns.tolist(), *columns, strict=True))
    return []


def read_csv(path: Path) -> Run:
    """Read a run that `write_csv` or another program wrote in this form.

    Raises
    ------
    InputError
        With the line, if it is not in this form.
    """
    open_input(path).close()
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            return _Reader(path, stream).run()
    except UnicodeDecodeError as error:
        raise InputError(path, "", "not UTF-8 text") from error
    except OSError as error:
        raise InputError(path, "", f"cannot read: {reason_of(error)}") from error


class _Reader:
    """Line by line through one file."""

    def __init__(self, path: Path, stream: TextIO) -> None:
        self._path, self._stream = path, stream
        self._line = 0

    def run(self) -> Run:
        first = self._read_line(HEAD_LIMIT)
        if not first.startswith(_HEAD):
            self._refuse(f"does not begin with {_HEAD.strip()!r}, as a run in CSV does")
        try:
            description = parse_description(json.loads(first.removeprefix(_HEAD)))
        except (ValueError, RecursionError) as error:
            self._refuse(str(error)[:200])
        devices: dict[str, DeviceSamples] = {}
        line = self._read_line(LINE_LIMIT)
        while line:
            name = self._device_name(line, description)
            if name in devices:
                self._refuse(f"device {name!r:.80} stands twice")
            samples, line = self._device(name, description)
            if samples is not None:
                devices[name] = samples
        return description.run(str(self._path), devices)

    def _read_line(self, limit: int) -> str:
        self._line += 1
        line = self._stream.readline(limit)
        if len(line) == limit:
            self._refuse(f"longer than {limit} characters")
        return line

    def _device_name(self, line: str, description: Description) -> str:
        try:
            name = json.loads(line.removeprefix(_DEVICE)) if line.startswith(_DEVICE) else None
        except (ValueError, RecursionError):
            name = None
        if not isinstance(name, str) or name not in description.devices:
            self._refuse("does not name one of the devices of the first line")
        return name

    def _device(self, name: str, description: Description) -> tuple[DeviceSamples | None, str]:
        """The table of one device, and the line after it."""
        rate, channels, overload = description.devices[name]
        expected = ["number", "time_ns", *(f"{each} [{description.channels[each].unit}]" for each in channels)]
        if next(csv.reader([self._read_line(LINE_LIMIT)]), []) != expected:
            self._refuse(f"the columns are not {','.join(expected)[:200]}")
        first_line = self._line
        counts: list[tuple[int, int]] = []
        values: list[list[float]] = []
        after = ""
        for line in self._rows():
            if line.startswith("#"):
                after = line
                break
            counts.append(self._row(line, len(channels), values))
            if len(counts) > ROW_LIMIT:
                self._refuse(f"more than {ROW_LIMIT} rows, the limit of this program")
        number, time_ns = np.array(counts, dtype=np.int64).reshape(-1, 2).T
        table = np.array(values, dtype=np.float64).reshape(-1, len(channels))
        with blamed_on(self._path, f"device {name!r:.80}, from line {first_line}"):
            columns = {channel: to_float32(table[:, at]) for at, channel in enumerate(channels)}
            return device_from_rows(name, rate, number, time_ns, columns, overload), after

    def _rows(self) -> Iterator[str]:
        while line := self._read_line(LINE_LIMIT):
            yield line

    def _row(self, line: str, channels: int, values: list[list[float]]) -> tuple[int, int]:
        """Number and time of a row; its values are appended."""
        fields = line.rstrip("\r\n").split(",")
        if len(fields) != channels + 2:
            self._refuse(f"has {len(fields)} values for {channels + 2} columns")
        try:
            number, time_ns = int(fields[0]), int(fields[1])
            values.append([float(field) if field else math.nan for field in fields[2:]])
        except ValueError as error:
            self._refuse(str(error)[:120])
        if not (0 <= number < 1 << 62 and 0 <= time_ns < 1 << 63):
            self._refuse("a number or a time out of range")
        return number, time_ns

    def _refuse(self, reason: str) -> NoReturn:
        raise InputError(self._path, f"line {self._line}", reason)
