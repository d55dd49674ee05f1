"""Recordings as a rig's own channels tell them."""

from __future__ import annotations

from dataclasses import replace

from recordings.run import Channel, Run
from twin.rigs import Rig

__all__ = ["in_directions_of", "own_channels"]


def own_channels(run: Run, rig: Rig) -> Run:
    """The run with those channels of the rig alone that have samples: others say nothing about it."""
    recorded = {name for device in run.devices.values() for name, samples in device.values.items() if len(samples)}
    used = recorded & {rig.force_sensor.channel, *(sensor.channel for sensor in rig.response_sensors)}
    devices = {
        name: replace(device, values={channel: x for channel, x in device.values.items() if channel in used})
        for name, device in run.devices.items()
        if used & set(device.values)
    }
    return replace(run, channels={n: c for n, c in run.channels.items() if n in used}, devices=devices)


def in_directions_of(run: Run, first: Run, *, force: str) -> Run:
    """The run with a force that is positive upwards, and with responses as in the `first` of all runs.

    A model's even harmonics know up from down, so the force must; a response turns with its sensor.
    """
    wanted = {name: name != force and _downwards(first.channels.get(name, c)) for name, c in run.channels.items()}
    turned = [name for name, channel in run.channels.items() if _downwards(channel) != wanted[name]]
    if not turned:
        return run
    channels = {n: replace(c, direction=_turned(c.direction)) if n in turned else c for n, c in run.channels.items()}
    devices = {
        name: replace(device, values={n: -x if n in turned else x for n, x in device.values.items()})
        for name, device in run.devices.items()
    }
    return replace(run, channels=channels, devices=devices)


def _downwards(channel: Channel) -> bool:
    return channel.direction.startswith("-")


def _turned(direction: str) -> str:
    return f"+{direction[1:]}" if direction.startswith("-") else f"-{direction.lstrip('+')}"
