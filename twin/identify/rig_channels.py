"""Recordings as a rig's own channels tell them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from recordings.directions import cosine, direction_name, unit_vector
from recordings.errors import InputError
from recordings.run import Channel, Run
from twin.rigs import Rig

__all__ = ["faces_against", "in_directions_of", "own_channels", "without_channels"]


def own_channels(run: Run, rig: Rig) -> Run:
    """The run with those channels of the rig alone that have samples: others say nothing about it."""
    recorded = {name for device in run.devices.values() for name, samples in device.values.items() if len(samples)}
    used = recorded & {rig.force_sensor.channel, *(sensor.channel for sensor in rig.response_sensors)}
    return without_channels(run, set(run.channels) - used)


def without_channels(run: Run, lost: Collection[str]) -> Run:
    """The run without some of its channels, and without devices that have no other."""
    devices = {
        name: replace(device, values={channel: x for channel, x in device.values.items() if channel not in lost})
        for name, device in run.devices.items()
        if set(device.values) - set(lost)
    }
    return replace(run, channels={n: c for n, c in run.channels.items() if n not in lost}, devices=devices)


def in_directions_of(run: Run, first: Run, rig: Rig) -> Run:
    """The run with a force that is positive along the rig's drive, and with responses as in the `first` of all runs.

    A model's even harmonics know up from down, so the force must; a response turns with its sensor.

    Raises
    ------
    InputError
        If the force or a response lies across what the rig, or the first run, says of its direction.
    """
    turned = [channel.name for channel in run.channels.values() if _against(channel, run, first, rig)]
    if not turned:
        return run
    channels = {n: replace(c, direction=_turned(c.direction)) if n in turned else c for n, c in run.channels.items()}
    devices = {
        name: replace(device, values={n: -x if n in turned else x for n, x in device.values.items()})
        for name, device in run.devices.items()
    }
    return replace(run, channels=channels, devices=devices)


def faces_against(channel: Channel, run: Run, rig: Rig) -> bool:
    """Whether a channel of a run points against what the rig file says of its sensor; InputError if across it."""
    try:
        return rig.place_of(channel.name).faces_against(channel.direction)
    except ValueError as error:
        reason, hint = str(error), "correct the sensor's direction in the rig file, or the recording's"
        raise InputError(run.path, f"channel {channel.name}", reason, hint) from error


def _against(channel: Channel, run: Run, first: Run, rig: Rig) -> bool:
    """Whether a channel is to be turned."""
    if channel.name == rig.force_sensor.channel:
        return faces_against(channel, run, rig)
    return cosine(first.channels.get(channel.name, channel).direction, channel.direction) < 0


def _turned(direction: str) -> str:
    return direction_name([-value for value in unit_vector(direction)])
