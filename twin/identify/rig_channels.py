"""Recordings as a rig's own channels tell them."""

from collections.abc import Collection
from dataclasses import replace

from recordings.directions import cosine, direction_name, unit_vector
from recordings.errors import InputError, blamed_on
from recordings.run import Channel, Run
from twin.rigs import Rig

NAMED, RENAMED = "drive", "force cell"
"""Keys of a run's record: its drive, and what its force was called where that is not the first's."""


def own_channels(run: Run, rig: Rig) -> Run:
    """The run with those channels of the rig alone that have samples: others say nothing about it.

    The force cell that was driven through has the name of the rig's first then, whichever it is.
    """
    run = _driven_through_first(run, rig)
    recorded = {name for device in run.devices.values() for name, samples in device.values.items() if len(samples)}
    used = recorded & {rig.force_sensor.channel, *(sensor.channel for sensor in rig.response_sensors)}
    return without_channels(run, set(run.channels) - used)


def drive_of(run: Run, rig: Rig) -> str:
    """Which of a rig's drives made a run: the one it names, else that of the force it holds or alone has.

    Where neither tells, it is the first.

    InputError if it names one that is none of the rig's.
    """
    cells = rig.force_cells
    if len(cells) < 2:
        return next(iter(rig.drives))
    if NAMED in run.info:
        if run.info[NAMED] not in cells:
            reason = f"drive {run.info[NAMED]!r} is none of the rig's"
            raise InputError(run.path, f"metadata run, {NAMED}", reason, f"it has {', '.join(cells)}")
        return run.info[NAMED]
    for names in ({step.target_channel for step in run.steps}, set(run.channels)):
        found = [drive for drive, cell in cells.items() if cell in names]
        if len(found) == 1:
            return found[0]
    return next(iter(rig.drives))


def _driven_through_first(run: Run, rig: Rig) -> Run:
    """The run with its drive named, and the force of that drive under the name of the rig's first force cell."""
    drive, first = drive_of(run, rig), rig.force_sensor.channel
    cell = rig.force_cells.get(drive, first)
    if cell == first or RENAMED in run.info:
        return run
    if cell not in run.channels:
        raise InputError(run.path, f"channel {cell}", "not recorded", f"it is the force cell of drive {drive!r}")
    run = without_channels(run, {first})
    names = {name: name for name in run.channels} | {cell: first}
    devices = {
        name: replace(
            device,
            values={names[n]: x for n, x in device.values.items()},
            overload={names.get(n, n): count for n, count in device.overload.items()},
        )
        for name, device in run.devices.items()
    }
    return replace(
        run,
        info={**run.info, NAMED: drive, RENAMED: cell},
        channels={names[n]: replace(channel, name=names[n]) for n, channel in run.channels.items()},
        devices=devices,
        steps=tuple(replace(s, target_channel=names.get(s.target_channel, s.target_channel)) for s in run.steps),
    )


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

    InputError if the force or a response lies across what the rig, or the first run, says of its direction.
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
    forced = channel.name == rig.force_sensor.channel
    place = rig.drives[drive_of(run, rig)] if forced else rig.place_of(channel.name)
    advice = "correct the sensor's direction in the rig file, or the recording's"
    with blamed_on(run.path, f"channel {channel.name}", advice):
        return place.faces_against(channel.direction)


def _against(channel: Channel, run: Run, first: Run, rig: Rig) -> bool:
    """Whether a channel is to be turned."""
    if channel.name == rig.force_sensor.channel:
        return faces_against(channel, run, rig)
    return cosine(first.channels.get(channel.name, channel).direction, channel.direction) < 0


def _turned(direction: str) -> str:
    return direction_name([-value for value in unit_vector(direction)])
