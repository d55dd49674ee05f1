"""Runs as universal files: data set 58, one for each channel and unbroken stretch of samples.

Written in binary with double precision, so that every float32 comes back.  What the fixed fields of data set 58
cannot hold exactly stands in its five text lines as ``key=value`` pairs.  Data sets that no channel of a run can
hold (spectra, sound pressure, geometry) are kept as attachments ``uff/<number>.uff`` and written back from there.
"""

import re
import warnings
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
from numpy.typing import NDArray

from recordings.beside import temporary_folder
from recordings.container.metadata import run_record
from recordings.convert.blocks import TIME_STEP_NS, blocks_of, device_from_rows, to_float32
from recordings.convert.uff_fields import channel_of, fields_of, quantity_of, start_ns_of, text_pairs
from recordings.errors import InputError, blamed_on
from recordings.reader import open_input
from recordings.run import Channel, DeviceSamples, Event, Run

SIZE_LIMIT_BYTES = 512 << 20
ATTACHMENT = "uff/"
_TIME_RESPONSE, _REAL, _EVEN = 1, (2, 4), 1
_TAG = re.compile(rb"    -1(?= {74}|[\r\n]|\Z)")


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """One data set as a stretch of one channel."""

    channel: Channel
    sample_rate_Hz: float
    start_ns: int
    first_index: int
    values: NDArray[np.float32]


def write_uff(run: Run, path: Path) -> list[str]:
    """Write the samples of a run; the result names what universal files have no place for."""
    with path.open("xb") as target, temporary_folder("twin-uff") as folder:
        one = folder / "one.uff"
        for node, channel in enumerate(run.channels.values(), start=1):
            for piece in _pieces(run, channel):
                with blamed_on(path):
                    fields = fields_of(
                        channel, node, run.info, piece.sample_rate_Hz, piece.start_ns, piece.first_index
                    )  # fmt: skip
                data = piece.values.astype(np.float64)
                # pyuff looks at the first two abscissas only.  It rereads the whole file after each set, so each has
                # a file of its own; its mode "overwrite" loses the head of a binary set.
                abscissa = np.arange(2) / piece.sample_rate_Hz
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves its file to be closed by Python
                    pyuff.UFF(str(one)).write_sets({**fields, "data": data, "x": abscissa}, mode="add")
                target.write(one.read_bytes())
                one.unlink()
        for name, content in run.attachments.items():
            if name.startswith(ATTACHMENT):
                target.write(content)
    overloads = sum(sum(device.overload.values()) for device in run.devices.values())
    lost = {
        "overload counts": overloads, "steps": len(run.steps), "events": len(run.events),
        "indicators": len(run.indicators),
        "attachments": sum(not name.startswith(ATTACHMENT) for name in run.attachments),
    }  # fmt: skip
    return [f"{count} {what} have no place in a universal file" for what, count in lost.items() if count]


def _pieces(run: Run, channel: Channel) -> Iterator[_Piece]:
    """Unbroken stretches of finite samples: pyuff would write a zero for a lost one."""
    device = run.devices.get(channel.device)
    if device is None or channel.name not in device.values:
        return
    parts: list[_Piece] = []
    for part in _finite_parts(device, channel):
        if parts:
            first, last = parts[0], parts[-1]
            passed_ns = round((part.first_index - first.first_index) * 1e9 / part.sample_rate_Hz)
            follows = part.first_index == last.first_index + len(last.values)
            if not follows or abs(part.start_ns - first.start_ns - passed_ns) > TIME_STEP_NS:
                yield replace(first, values=np.concatenate([each.values for each in parts]))
                parts = []
        parts.append(part)
    if parts:
        yield replace(parts[0], values=np.concatenate([each.values for each in parts]))


def _finite_parts(device: DeviceSamples, channel: Channel) -> Iterator[_Piece]:
    """Each block's stretches of finite samples."""
    for block in blocks_of(device):
        values = block.samples[channel.name]
        finite = np.flatnonzero(np.isfinite(values))
        for stretch in np.split(finite, 1 + np.flatnonzero(np.diff(finite) != 1)):
            if len(stretch):
                start, stop = int(stretch[0]), int(stretch[-1]) + 1
                yield _Piece(
                    channel=channel, sample_rate_Hz=block.sample_rate_Hz, first_index=block.first_index + start,
                    start_ns=block.time_at(start), values=values[start:stop],
                )  # fmt: skip


def read_uff(path: Path) -> Run:
    """Read the time histories of a universal file whose units a run can hold; the rest becomes attachments.

    Raises
    ------
    InputError
        With the data set, if it is no universal file, damaged, or larger than `SIZE_LIMIT_BYTES`.
    """
    data, sets = load_sets(path)
    pieces: list[_Piece] = []
    attachments: dict[str, bytes] = {}
    events: list[Event] = []
    sources: set[str] = set()
    for number, (content, raw) in enumerate(zip(sets, _split(path, data, len(sets)), strict=True), start=1):
        piece, reason = _piece(path, content, number)
        if piece is None:
            attachments[f"{ATTACHMENT}{number}.uff"] = raw
            detail = f"data set {number}: {reason}; kept as attachment {ATTACHMENT}{number}.uff"
            events.append(Event(time_ns=0, source="convert", kind="not-converted", detail=detail))
        else:
            pieces.append(piece)
            sources.add(text_pairs(content).get("source", "measured"))
    channels = {piece.channel.name: piece.channel for piece in pieces}
    devices = _devices(path, pieces)
    start_ns = min((piece.start_ns for piece in pieces), default=0)
    events = [replace(event, time_ns=start_ns) for event in events]
    source = sources.pop() if len(sources) == 1 else "measured"
    info = run_record(start_ns, source=source, procedure=f"universal file {path.name}")
    return Run(
        path=str(path), info=info, channels=channels, devices=devices, steps=(), events=tuple(events),
        attachments=attachments,
    )  # fmt: skip


def load_sets(path: Path, *, kinds: Collection[int] = (58,)) -> tuple[bytes, list[dict[str, Any]]]:
    """The file's bytes, and its data sets of these kinds as pyuff gives them; of others the kind alone.

    Raises
    ------
    InputError
        With the data set, if it is no universal file, damaged, or larger than `SIZE_LIMIT_BYTES`.
    """
    with open_input(path) as stream:
        data = stream.read(SIZE_LIMIT_BYTES + 1)
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for universal files")
    number = 0
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of pyuff's own parsing
            file = pyuff.UFF(str(path))
            found = [int(kind) for kind in file.get_set_types()]
            if not found:
                raise InputError(path, "", "is not a universal file: it has no data set")
            sets = []
            for number, kind in enumerate(found, start=1):
                sets.append(file.read_sets(number - 1) if kind in kinds else {"type": kind})
    except InputError:
        raise
    except Exception as error:  # pyuff raises bare exceptions for whatever it cannot parse
        raise InputError(path, f"data set {number}", "cannot be read as a universal file") from error
    return data, sets


def _split(path: Path, data: bytes, count: int) -> list[bytes]:
    """The bytes of each data set with its tags, found as pyuff finds them."""
    tags = [match.start() for match in _TAG.finditer(data)]
    if len(tags) % 2:
        raise InputError(path, f"data set {len(tags) // 2 + 1}", "has no end: the file is cut")
    if len(tags) // 2 != count:
        raise InputError(path, "", "its data sets are not delimited as they should be")
    return [data[start:stop] + b"    -1\n" for start, stop in zip(tags[::2], tags[1::2], strict=False)]


def _piece(path: Path, fields: dict[str, Any], number: int) -> tuple[_Piece | None, str]:
    """A data set as a stretch of a channel, or why it cannot be one."""
    if fields["type"] != 58:
        return None, f"it is of kind {fields['type']}"
    even = fields["abscissa_spacing"] == _EVEN
    if fields["func_type"] != _TIME_RESPONSE or fields["ord_data_type"] not in _REAL or not even:
        return None, "it is no evenly sampled real time history"
    found = quantity_of(fields)
    if found is None:
        label, unit = fields["ordinate_axis_lab"], fields["ordinate_axis_units_lab"]
        return None, f"a run cannot hold {label!r:.40} in {unit!r:.40}"
    quantity, factor = found
    pairs = text_pairs(fields)
    name = str(fields["id1"] if "device" in pairs else fields["rsp_ent_name"]).strip() or f"channel{number}"
    step_s = float(fields["abscissa_inc"])
    with blamed_on(path, f"data set {number}", of=(ValueError, ZeroDivisionError, OverflowError)):
        rate_Hz = float(pairs["sample_rate_Hz"]) if "sample_rate_Hz" in pairs else 1 / step_s
        if not 0 < rate_Hz < 1e12:
            raise ValueError(f"a sampling interval of {step_s} s")
        count = int(fields["num_pts"])
        if count != len(fields["data"]) and not 0 <= len(fields["data"]) - count <= 1:
            raise ValueError(f"{len(fields['data'])} values where {count} should be")
        with np.errstate(over="ignore", invalid="ignore"):
            values = to_float32(np.asarray(fields["data"][:count], dtype=np.float64) * factor)
        piece = _Piece(
            channel=channel_of(fields, quantity, name), sample_rate_Hz=rate_Hz, start_ns=start_ns_of(fields),
            first_index=int(pairs.get("first_index", "0")), values=values,
        )  # fmt: skip
    return piece, ""


def _devices(path: Path, pieces: list[_Piece]) -> dict[str, DeviceSamples]:
    """The stretches put together by device; stretches of one device differ in channels or in numbers."""
    by_device: defaultdict[str, list[_Piece]] = defaultdict(list)
    for piece in pieces:
        by_device[piece.channel.device].append(piece)
    devices: dict[str, DeviceSamples] = {}
    for name, parts in by_device.items():
        with blamed_on(path, f"device {name!r:.80}"):
            device = _device(name, parts)
        if device is not None:
            devices[name] = device
    return devices


def _device(name: str, parts: list[_Piece]) -> DeviceSamples | None:
    if len({part.sample_rate_Hz for part in parts}) > 1:
        raise ValueError("its data sets have different sampling intervals")
    number = np.unique(np.concatenate([part.first_index + np.arange(len(part.values)) for part in parts]))
    time_ns = np.zeros(len(number), dtype=np.int64)
    values: dict[str, NDArray[np.float32]] = {}
    taken: dict[str, NDArray[np.bool_]] = {}
    for part in parts:
        at = np.searchsorted(number, part.first_index)
        rows = slice(int(at), int(at) + len(part.values))
        channel = part.channel.name
        series = values.setdefault(channel, np.full(len(number), np.nan, dtype=np.float32))
        filled = taken.setdefault(channel, np.zeros(len(number), dtype=np.bool_))
        if filled[rows].any():
            raise ValueError(f"channel {channel!r:.80} has two data sets for the same time")
        filled[rows] = True
        series[rows] = part.values
        steps = np.arange(len(part.values)) * (1e9 / part.sample_rate_Hz)
        time_ns[rows] = part.start_ns + np.rint(steps).astype(np.int64)
    return device_from_rows(name, parts[0].sample_rate_Hz, number, time_ns, values, {})
