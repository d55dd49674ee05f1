"""One fault on virtual instruments, acquired as a user would, and what became of every sample in the recording.

The source is a tone whose samples can be computed again, so each stored number is compared with the one that was sent.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.virtual import Addresses, VirtualRig, parse_fault
from drivers.virtual.tone import Tone
from recordings import DeviceSamples, Event, Run, read_run

CHANNELS = {"force": "daq", "acc1": "daq", "acc2": "can", "acc3": "can"}
PAST_ITS_TIME_ns = 278
"""A tenth of a degree at 1 kHz; a sample stored with a time that is off by more is a wrong number."""
_SETTINGS = "timeout_s = 1.0\nreconnect_s = 2.0\n"


@dataclass(frozen=True)
class Case:
    """A fault as on the command line, what a recording must say of it, and how fast and long the rig runs."""

    name: str
    fault: str
    kinds: tuple[str, ...]
    speed: float | None = None
    seconds: float = 8.0


CASES = (
    Case("no fault", "", ()),
    Case("flipped bits on the line", "flip:device=daq,probability=0.1", ("checksum",)),
    Case("flipped bits on the bus", "flip:device=can,probability=0.03", ("bus-error",)),
    Case("frames dropped on the line", "drop:device=daq,probability=0.1", ("lost-samples",)),
    Case("frames dropped on the bus", "drop:device=can,probability=0.03", ("lost-samples",)),
    Case("frames doubled on the line", "duplicate:device=daq,probability=0.2", ("duplicate",)),
    Case("frames doubled on the bus", "duplicate:device=can,probability=0.03", ("duplicate",)),
    Case("frames out of order on the line", "reorder:device=daq,probability=0.1", ("reordered",)),
    Case("frames out of order on the bus", "reorder:device=can,probability=0.03", ("reordered",)),
    Case("instrument stalls", "stall:device=daq,at_s=3,seconds=4.5", ("silent",), 2.0, 14.0),
    Case("node stalls", "stall:device=can,at_s=3,seconds=4.5", ("silent",), 2.0, 14.0),
    Case("line cut, device returns", "disconnect:device=daq,at_s=3,seconds=0.3", ("reconnected",), 5.0),
    Case("instrument vanishes", "disconnect:device=daq,at_s=3,seconds=inf", ("disconnected",), 20.0),
    Case("node vanishes", "disconnect:device=can,at_s=3,seconds=inf", ("silent", "disconnected"), 20.0),
    Case("instrument restarts", "restart:device=daq,at_s=3", ("device-restart",), 20.0),
    Case("node restarts", "restart:device=can,at_s=3", ("device-restart", "silent"), 20.0),
    Case("sensor stuck, on the line", "stuck:channel=acc1,at_s=3,seconds=2", ("stuck",)),
    Case("sensor stuck, on the bus", "stuck:channel=acc2,at_s=3,seconds=2", ("stuck",)),
    Case("overload, on the line", "overload:channel=acc1,at_s=3,seconds=2,factor=10", ("overload",)),
    Case("overload, on the bus", "overload:channel=acc2,at_s=3,seconds=2,factor=10", ("overload",)),
    Case("clock off", "clock:device=can,ppm=40,offset_s=3", ("clock",)),
    Case("noise on the bus", "noise:device=can,probability=0.05,at_s=2", ("bus-error",)),
    Case("noise that drives it off the bus", "noise:device=can,probability=0.7,at_s=2,seconds=2", ("bus-off",)),
)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one try gave.

    `happened` counts the faults; `noticed` is whether an event of the right kind is in the recording and was told at
    the end; `lost` are samples told as lost, `stored` those in the file, of all channels; `silently_wrong` are stored
    samples that are not what was sent or have a wrong time, and missing ones, of which nothing is told.
    """

    happened: int
    noticed: bool
    stored: int
    lost: int
    silently_wrong: int
    events: dict[str, int] = field(default_factory=dict)


@contextmanager
def served_tone(
    folder: Path, *, fault: str = "", speed: float | None = None, seed: int = 0, sample_rate_Hz: float = 1024.0
) -> Iterator[tuple[VirtualRig, Tone, Path]]:
    """The virtual instruments of a tone in a thread, the tone, and the client's file of their addresses."""
    tone = Tone(list(CHANNELS), sample_rate_Hz=sample_rate_Hz)
    on_can = tuple(name for name, device in CHANNELS.items() if device == "can")
    rig = VirtualRig(
        tone, Addresses(tcp="127.0.0.1:0", can=f"unixbus:{folder / 'bus'}", can_channels=on_can),
        speed=speed, faults=[parse_fault(fault)] if fault else [], seed=seed,
    )  # fmt: skip
    instruments = folder / "instruments.toml"
    instruments.write_text(_SETTINGS + rig.instruments_toml, encoding="utf-8")
    stopping = threading.Event()
    thread = threading.Thread(target=rig.serve, args=(stopping.is_set,), name="virtual instruments")
    thread.start()
    try:
        yield rig, tone, instruments
    finally:
        stopping.set()
        thread.join()


def try_fault(case: Case, folder: Path, *, seed: int, acquire: Callable[[Sequence[str]], Mapping[str, Any]]) -> Outcome:
    """Serve, acquire, read back, compare.

    Parameters
    ----------
    folder
        Empty.
    acquire
        Runs the program with these arguments; gives what it tells at the end, its count of `events` by kind and source.
    """
    out = folder / "run.mcap"
    with served_tone(folder, fault=case.fault, speed=case.speed, seed=seed) as (rig, tone, instruments):
        told = acquire(["--instruments", str(instruments), "--out", str(out), "--seconds", str(case.seconds)])
        happened = sum(rig.fault_hits.values())
    run = read_run(out)
    in_file = Counter(f"{event.kind} ({event.source})" for event in run.events)
    kinds = {event.kind for event in run.events}
    wrong, stored = judge(run, tone, case.fault)
    carried = Counter(CHANNELS.values())
    lost = Counter[str]()
    for event in run.events:
        if event.kind == "lost-samples":
            lost[event.source] += carried[event.source] * int(event.detail.split()[0])
    for name, device in run.devices.items():
        wrong += max(0, carried[name] * sum(gap.count for gap in device.gaps) - lost[name])
    return Outcome(
        happened=happened,
        noticed=any(kind in kinds for kind in case.kinds) if case.kinds else bool(kinds),
        stored=stored, lost=sum(lost.values()),
        silently_wrong=wrong + (in_file != Counter(told["events"])),
        events=dict(in_file),
    )  # fmt: skip


def judge(run: Run, tone: Tone, fault: str = "") -> tuple[int, int]:
    """How many samples of a recording are wrong and not told to be, and how many there are."""
    spoilt = parse_fault(fault) if fault.startswith(("stuck", "overload")) else None
    wrong = stored = 0
    for name in run.channels:
        device = next((each for each in run.devices.values() if name in each.values), None)
        if device is None:
            continue
        values, channel = device.values[name], next(each for each in tone.channels if each.name == name)
        limit = float(channel.range or 1.0)
        truth = tone.values(name, device.first_index, len(values))
        if spoilt is not None and spoilt.kind == "overload" and spoilt.values["channel"] == name:
            number = device.first_index + np.arange(len(values))
            hit = _within(number / tone.sample_rate_Hz, spoilt.number("at_s"), spoilt.number("seconds"))
            factor = np.float32(spoilt.number("factor"))
            truth = np.where(hit, np.clip(truth * factor, -np.float32(limit), np.float32(limit)), truth)
        if device.device == "can":
            truth = _through_16_bits(truth, limit)
        there = ~np.isnan(values)
        differ = there & (values != truth)
        if spoilt is not None and spoilt.kind == "stuck":
            differ &= ~_told_stuck(run.events, name, device, tone.sample_rate_Hz)
        clipped = int(np.count_nonzero(there & (np.abs(truth) >= np.float32(limit))))
        wrong += int(np.count_nonzero(differ)) + abs(device.overload.get(name, 0) - clipped)
        wrong += _mistimed(device, tone.sample_rate_Hz)
        stored += int(np.count_nonzero(there))
    return wrong, stored


def _within(time_s: NDArray[np.float64], start_s: float, seconds: float) -> NDArray[np.bool_]:
    return np.asarray((time_s >= start_s) & (time_s < start_s + seconds))


def _through_16_bits(values: NDArray[np.float32], limit: float) -> NDArray[np.float32]:
    """What the node's converter makes of them, and the host of that."""
    counts = np.clip(np.rint(values.astype(float) * (32767 / limit)), -32767, 32767)
    return np.asarray(counts.astype(np.float32) * np.float32(limit / 32767))


def _told_stuck(
    events: tuple[Event, ...], channel: str, device: DeviceSamples, sample_rate_Hz: float
) -> NDArray[np.bool_]:
    """Which positions of a channel lie between an event that it is stuck and one that it moves again."""
    told = np.zeros(len(device), bool)
    for event in events:
        if event.source == channel and event.kind in ("stuck", "moves-again"):
            told[max(0, round(event.time_ns * 1e-9 * sample_rate_Hz) - device.first_index) :] = event.kind == "stuck"
    return told


def _mistimed(device: DeviceSamples, sample_rate_Hz: float) -> int:
    """Samples in blocks whose time is not that of their number on the generator's clock."""
    starts = device.block_start
    due_ns = np.rint((device.first_index + starts) * (1e9 / sample_rate_Hz)).astype(np.int64)
    lengths = np.diff(np.append(starts, len(device)))
    return int(lengths[np.abs(device.block_time_ns - due_ns) > PAST_ITS_TIME_ns].sum())
