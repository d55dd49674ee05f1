"""Faults on purpose: what goes wrong on a line, in a sensor, in a clock; seeded, so that each run repeats.

A fault is written ``KIND:key=value,...``; keys that are left out have defaults, and times are seconds of the device's
time since it was made.  A device is ``daq``, ``can`` or ``meter``; the meter sends no frames.

=========== ============================================ ==========================================================
kind        keys                                         does
=========== ============================================ ==========================================================
drop        device, probability, after_s                 leaves frames out
flip        device, probability, after_s                 turns one bit of a frame over; on the CAN bus every
                                                         controller's checksum finds that, so it acts as noise does
duplicate   device, probability, after_s                 sends frames twice
reorder     device, probability, after_s                 sends a frame after the one that follows it; on the CAN bus
                                                         after the next one of the same identifier
stall       device, at_s, seconds                        sends nothing for a while of real time
disconnect  device, at_s, seconds                        cuts the line for a while of real time; the device goes on,
                                                         and the client may come back
restart     device, at_s                                 loses its power for a moment, and forgets what it was doing
stuck       channel, at_s, seconds                       a sensor keeps its last value
overload    channel, at_s, seconds, factor               multiplies a signal so that the converter clips
noise       device, probability, at_s, seconds           destroys frames on the CAN bus, which are sent again; a node
                                                         whose frames fail too often goes off the bus for a while
clock       device, ppm, offset_s                        the CAN node's clock is fast and ahead of the generator's
=========== ============================================ ==========================================================
"""

import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from recordings.errors import InputError
from recordings.run import Channel, SampleBlock

_DEFAULTS: dict[str, dict[str, float | str]] = {
    "drop": {"device": "daq", "probability": 0.01, "after_s": 0.0},
    "flip": {"device": "daq", "probability": 0.01, "after_s": 0.0},
    "duplicate": {"device": "daq", "probability": 0.01, "after_s": 0.0},
    "reorder": {"device": "daq", "probability": 0.01, "after_s": 0.0},
    "stall": {"device": "daq", "at_s": 1.0, "seconds": 1.0},
    "disconnect": {"device": "daq", "at_s": 1.0, "seconds": 0.5},
    "restart": {"device": "daq", "at_s": 1.0},
    "stuck": {"channel": "acc1", "at_s": 1.0, "seconds": math.inf},
    "overload": {"channel": "acc1", "at_s": 1.0, "seconds": math.inf, "factor": 1e3},
    "noise": {"device": "can", "probability": 0.05, "at_s": 1.0, "seconds": math.inf},
    "clock": {"device": "can", "ppm": 20.0, "offset_s": 0.0},
}
_NEEDS: dict[str, tuple[tuple[str, ...], str]] = {
    **dict.fromkeys(
        ("drop", "flip", "duplicate", "reorder"), (("daq", "can"), "only a device that sends frames has it")
    ),
    "noise": (("can",), "only a CAN bus has it"),
    "clock": (("can",), "only the CAN node has a clock of its own"),
}
"""Devices that a fault can happen to, where not to all, and why."""


@dataclass(frozen=True)
class Fault:
    """A kind of fault and its numbers."""

    kind: str
    values: dict[str, float | str] = field(default_factory=dict)

    def number(self, key: str) -> float:
        """One of its numbers."""
        return float(self.values[key])


def parse_fault(text: str) -> Fault:
    """Read ``KIND:key=value,...``.

    Raises
    ------
    InputError
        If the kind or a key is unknown or a value is no number.
    """
    kind, _, rest = text.partition(":")
    if kind not in _DEFAULTS:
        raise InputError(
            "--fault", text[:60], f"no such kind of fault: {kind[:30]!r}", "one of " + ", ".join(_DEFAULTS)
        )
    values = dict(_DEFAULTS[kind])
    for part in filter(None, rest.split(",")):
        key, separator, value = part.partition("=")
        if key not in values or not separator:
            raise InputError("--fault", text[:60], f"{key[:30]!r} is not a key of {kind}", "keys: " + ", ".join(values))
        if isinstance(values[key], str):
            values[key] = value
            continue
        try:
            values[key] = float(value)
        except ValueError:
            raise InputError("--fault", text[:60], f"{key} is not a number: {value[:30]!r}") from None
        if math.isnan(float(values[key])) or (key == "probability" and not 0 <= float(values[key]) <= 1):
            raise InputError("--fault", text[:60], f"{key} is out of range: {value[:30]}")
    return Fault(kind, values)


class LinkFaults:
    """What goes wrong between one device and its client.

    Parameters
    ----------
    faults
        Those of this device.
    generator
        Decides which frames are hit.
    hits
        Counts, by kind, how often each fault happened; one of its own if left out.
    """

    def __init__(
        self,
        faults: Sequence[Fault] = (),
        generator: np.random.Generator | None = None,
        hits: Counter[str] | None = None,
    ) -> None:
        self._random = [f for f in faults if f.kind in ("drop", "flip", "duplicate", "reorder")]
        self._noise = [f for f in faults if f.kind == "noise"]
        self._timed = [f for f in faults if f.kind in ("stall", "disconnect", "restart")]
        self._generator = generator or np.random.default_rng(0)
        self._hits: Counter[str] = Counter() if hits is None else hits
        self._held: dict[int, Any] = {}
        self._time_s = 0.0
        self._stalled_until = 0.0
        self._away_until = 0.0

    def start(self, index: int) -> None:
        """A stream starts: nothing is held back from an earlier one."""
        self._held = {}

    def pass_on(self, item: Any) -> list[Any]:
        """The frames that leave in place of `item`."""
        if not self._random:
            return [item]
        items, stream = [item], _stream_of(item)
        for fault in self._random:
            if self._time_s < fault.number("after_s") or self._generator.random() >= fault.number("probability"):
                continue
            if fault.kind == "reorder" and (stream in self._held or not items):
                continue
            self._hits[fault.kind] += 1
            if fault.kind == "drop":
                items = []
            elif fault.kind == "duplicate":
                items = items * 2
            elif fault.kind == "flip":
                items = [_flip_bytes(one, self._generator) for one in items]
            else:
                self._held[stream] = items.pop()
                return items
        return items + ([self._held.pop(stream)] if items and stream in self._held else [])

    def flush(self) -> list[Any]:
        """What was held back to be sent late."""
        held, self._held = self._held, {}
        return list(held.values())

    def advance(self, time_s: float) -> Literal["", "disconnect", "restart"]:
        """Device time goes on; what happens to the device now, beside a stall."""
        self._time_s = time_s
        happens: Literal["", "disconnect", "restart"] = ""
        for fault in [fault for fault in self._timed if time_s >= fault.number("at_s")]:
            self._timed.remove(fault)
            self._hits[fault.kind] += 1
            if fault.kind == "stall":
                self._stalled_until = time.monotonic() + fault.number("seconds")
            elif fault.kind == "disconnect":
                self._away_until = time.monotonic() + fault.number("seconds")
                happens = happens or "disconnect"
            else:
                happens = "restart"
        return happens

    @property
    def noisy(self) -> bool:
        """Whether the frame that is on the bus now is destroyed."""
        for fault in self._noise:
            if 0 <= self._time_s - fault.number("at_s") < fault.number(
                "seconds"
            ) and self._generator.random() < fault.number("probability"):
                self._hits[fault.kind] += 1
                return True
        return False

    @property
    def away(self) -> bool:
        """Whether the line is cut."""
        return self._away_until > 0.0 and time.monotonic() < self._away_until

    @property
    def stalled(self) -> bool:
        """Whether nothing may be sent now."""
        return self.away or (self._stalled_until > 0.0 and time.monotonic() < self._stalled_until)


def _stream_of(frame: Any) -> int:
    """Which frames have an order among themselves: on a line all, on a bus those of one identifier."""
    return int(getattr(frame, "arbitration_id", 0))


def _as_noise(flip: Fault) -> Fault:
    """A flipped bit as a CAN bus has it: checksum and bit stuffing give it away, and the frame is destroyed."""
    values = {"device": "can", "probability": flip.values["probability"], "at_s": flip.values["after_s"]}
    return Fault("noise", values | {"seconds": math.inf})


def _flip_bytes(frame: bytes, generator: np.random.Generator) -> bytes:
    """One bit of a frame turned over."""
    damaged = bytearray(frame)
    if damaged:
        bit = int(generator.integers(8 * len(damaged)))
        damaged[bit // 8] ^= 1 << (bit % 8)
    return bytes(damaged)


@dataclass(frozen=True)
class ClockFault:
    """A clock that shows ``time * (1 + ppm 1e-6) + offset``."""

    ppm: float = 0.0
    offset_s: float = 0.0

    def show(self, time_ns: int) -> int:
        """What the clock shows at a time."""
        return time_ns + round(time_ns * self.ppm * 1e-6) + round(self.offset_s * 1e9)


class FaultPlan:
    """All faults of a run, dealt to where they happen.

    Parameters
    ----------
    faults
        As parsed.
    seed
        Of all that is drawn.
    devices, channels
        What there is to blame.

    Attributes
    ----------
    hits
        How often each kind of fault has happened: to a frame, to a sensor, to a device.

    Raises
    ------
    InputError
        If a fault names a device or channel that is not there, or that it cannot happen to.
    """

    def __init__(
        self, faults: Sequence[Fault], *, seed: int, devices: Sequence[str], channels: Sequence[Channel]
    ) -> None:
        self._faults = list(faults)
        self._seed = seed
        self._channels = {channel.name: channel for channel in channels}
        self._last: dict[str, np.float32] = {}
        self._begun: set[int] = set()
        self.hits: Counter[str] = Counter()
        for fault in faults:
            able, why = _NEEDS.get(fault.kind, ((), ""))
            if able and fault.values["device"] not in able:
                raise InputError("--fault", fault.kind, why, f"device={able[0]}")
            for key, known in (("device", list(devices)), ("channel", list(self._channels))):
                if key in fault.values and fault.values[key] not in known:
                    name = str(fault.values[key])
                    raise InputError("--fault", fault.kind, f"there is no {key} {name!r}", "one of " + ", ".join(known))

    def link(self, device: str) -> LinkFaults:
        """Faults between a device and its client."""
        mine = [fault for fault in self._faults if fault.values.get("device") == device]
        if device == "can":
            mine = [_as_noise(fault) if fault.kind == "flip" else fault for fault in mine]
        return LinkFaults(mine, np.random.default_rng([self._seed, *device.encode()]), self.hits)

    def clock(self, device: str) -> ClockFault:
        """The clock of a device."""
        for fault in self._faults:
            if fault.kind == "clock" and fault.values["device"] == device:
                self.hits["clock"] += 1
                return ClockFault(fault.number("ppm"), fault.number("offset_s"))
        return ClockFault()

    def spoil(self, block: SampleBlock) -> SampleBlock:
        """What the sensors and the converter make of a block."""
        for number, fault in enumerate(self._faults):
            if fault.kind not in ("stuck", "overload"):
                continue
            name = str(fault.values["channel"])
            times = block.time_ns * 1e-9 + np.arange(len(block)) / block.sample_rate_Hz
            start = fault.number("at_s")
            hit = (times >= start) & (times < start + fault.number("seconds"))
            samples = block.samples[name]
            if not hit.any():
                self._last[name] = samples[-1]
                continue
            if number not in self._begun:
                self._begun.add(number)
                self.hits[fault.kind] += 1
            spoilt = samples.copy()
            overload = dict(block.overload)
            if fault.kind == "stuck":
                first = int(np.argmax(hit))
                value = samples[first - 1] if first else self._last.setdefault(name, samples[0])
                spoilt[hit] = value
                self._last[name] = value
            else:
                limit = np.float32(self._channels[name].range or 1.0)
                spoilt[hit] = np.clip(samples[hit] * np.float32(fault.number("factor")), -limit, limit)
                overload[name] = overload.get(name, 0) + int(np.count_nonzero(np.abs(spoilt[hit]) >= limit))
            block = replace(block, samples={**block.samples, name: spoilt}, overload=overload)
        return block
