"""Mistakes of a first day in a lab, put into runs in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Channel, DeviceSamples, Run, Step

__all__ = ["copied", "filled", "fitted", "relabelled", "retimed", "scaled", "stepped", "swapped", "thinned"]

Samples = NDArray[np.float32]


def fitted(run: Run, change: Callable[[DeviceSamples], dict[str, Any]]) -> Run:
    """With fields of its devices replaced."""
    return replace(run, devices={name: replace(device, **change(device)) for name, device in run.devices.items()})


def filled(run: Run, channel: str, change: Callable[[Samples], Samples]) -> Run:
    """With other samples of one channel, of a copy."""
    return fitted(
        run,
        lambda device: {
            "values": {n: change(x.copy()).astype(x.dtype) if n == channel else x for n, x in device.values.items()}
        },
    )


def scaled(run: Run, **factors: float) -> Run:
    """With samples times a factor, by channel."""
    for channel, factor in factors.items():
        run = filled(run, channel, lambda x, factor=factor: factor * x)  # type: ignore[misc]
    return run


def swapped(run: Run, one: str, two: str) -> Run:
    """With the samples of two channels exchanged."""
    names = {one: two, two: one}
    return fitted(run, lambda device: {"values": {n: device.values[names.get(n, n)] for n in device.values}})


def copied(run: Run, channel: str, source: str) -> Run:
    """With one channel's samples those of another."""
    return filled(run, channel, lambda x: np.array(run.device_of(source).values[source]))


def relabelled(run: Run, channel: str, **fields: Any) -> Run:
    """With other metadata of a channel."""
    changed: Channel = replace(run.channels[channel], **fields)
    return replace(run, channels={**run.channels, channel: changed})


def retimed(run: Run, factor: float) -> Run:
    """With all of the samples' time stamps multiplied, not the steps'."""
    return fitted(run, lambda device: {"block_time_ns": np.rint(device.block_time_ns * factor).astype(np.int64)})


def stepped(run: Run, change: Callable[[Step], dict[str, Any]]) -> Run:
    """With fields of its steps replaced."""
    return replace(run, steps=tuple(replace(step, **change(step)) for step in run.steps))


def thinned(run: Run, every: int) -> Run:
    """With every so manyth sample alone, and no filter before."""
    return fitted(
        run,
        lambda device: {
            "values": {n: x[::every] for n, x in device.values.items()},
            "sample_rate_Hz": device.sample_rate_Hz / every,
            "block_start": np.array([0]),
            "block_time_ns": device.block_time_ns[:1],
        },
    )
