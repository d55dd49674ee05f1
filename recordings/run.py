"""What a run is made of: channels, sample blocks, steps, events (the recording contract, version 1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

__all__ = ["Channel", "DeviceSamples", "Event", "Gap", "Indicator", "Run", "SampleBlock", "Step", "StepState"]


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured quantity; `range` is the converter's limit in the channel's unit."""

    name: str
    quantity: str
    unit: str
    position_m: float | None = None
    direction: str = "+y"
    range: float | None = None
    device: str = "daq"


@dataclass(frozen=True, kw_only=True)
class SampleBlock:
    """Equally spaced samples from one device; every series has the same length.

    `first_index` counts samples since the device started: a jump is a loss.
    """

    device: str
    time_ns: int
    first_index: int
    sample_rate_Hz: float
    samples: Mapping[str, NDArray[np.float32]]
    overload: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.samples.values()), ()))


class StepState(IntEnum):
    """What the procedure was doing."""

    SETTLING = 0
    MEASURING = 1
    DONE = 2
    ABORTED = 3


@dataclass(frozen=True, kw_only=True)
class Step:
    """The start of a state of one step of a sweep; `frequency_Hz` is 0 for broadband excitation."""

    time_ns: int
    sweep: str
    index: int
    frequency_Hz: float
    target_channel: str
    target_amplitude: float
    state: StepState


@dataclass(frozen=True, kw_only=True)
class Event:
    """A thing that went wrong or changed while recording."""

    time_ns: int
    source: str
    kind: str
    detail: str = ""


@dataclass(frozen=True, kw_only=True)
class Indicator:
    """One decimated value, for viewers that plot scalars."""

    name: str
    time_ns: int
    value: float
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class Gap:
    """Samples `first_index` .. `first_index + count - 1` of a device that were never received."""

    device: str
    first_index: int
    count: int


@dataclass(frozen=True, kw_only=True)
class DeviceSamples:
    """All samples of one device in order of time, in SI units; lost samples are NaN.

    `values[channel][i]` was taken at `time_ns[0] + i / sample_rate_Hz` when nothing was lost; blocks carry their
    own time stamps, so `block_start` (sample numbers) and `block_time_ns` give the exact mapping.
    """

    device: str
    sample_rate_Hz: float
    values: Mapping[str, NDArray[np.float32]]
    block_start: NDArray[np.int64]
    block_time_ns: NDArray[np.int64]
    overload: Mapping[str, int]
    gaps: tuple[Gap, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Run:
    """A recorded run in memory.

    `info` is the ``run`` metadata record (format, source, stored, rig, procedure, started, preload_N, ...);
    `attachments` holds ``rig.toml`` and ``procedure.toml`` where the run has them.
    """

    path: str
    info: Mapping[str, str]
    channels: Mapping[str, Channel]
    devices: Mapping[str, DeviceSamples]
    steps: tuple[Step, ...]
    events: tuple[Event, ...]
    indicators: tuple[Indicator, ...] = ()
    attachments: Mapping[str, bytes] = field(default_factory=dict)
