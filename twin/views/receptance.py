"""What a response channel reads per force, in the units of the pictures: displacement in mm, strain in µm/m."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from recordings.quantities import is_motion, is_response, quantity
from recordings.run import Channel
from twin.arrays import Array
from twin.views.style import unit_text


def per_force(response: Array, name: str, frequency_Hz: Array) -> Array:
    """Magnitude of what is read per force from a response per force, (f,) each, of a quantity's name."""
    measured = quantity(name)
    rate = (2 * np.pi * np.asarray(frequency_Hz)) ** measured.derivative
    return np.asarray(measured.factor * np.abs(response) / rate)


def phase_deg(response: Array, name: str) -> Array:
    """Of the motion ahead of the force, from -270 to 90 degrees, so that no resonance wraps it."""
    ahead = np.degrees(np.angle(response)) - 90.0 * quantity(name).derivative
    return np.asarray((ahead + 270.0) % 360.0 - 270.0)


def per_force_label(channel: str, name: str) -> str:
    """Of an axis: ``receptance at acc1, mm/N``, or ``strain at gauge per force, µm/m/N``."""
    measured = quantity(name)
    what = f"receptance at {channel}" if is_motion(name) else f"{measured.reads} at {channel} per force"
    return f"{what}, {measured.pictured}/N"


def response_label(channel: str, unit: str, force: str = "force") -> str:
    """Of an axis: ``|acc1 / force|, m/s²/N``."""
    return f"|{channel} / {force}|, {unit_text(unit)}/N"


def reading_label(channel: str, name: str) -> str:
    """Of an axis: ``displacement at acc1, mm``."""
    measured = quantity(name)
    return f"{measured.reads} at {channel}, {measured.pictured}"


def branch_curves(branches: Iterable[Mapping[str, Any]], channel: Channel) -> list[tuple[float, Array, Array]]:
    """A rehearsal's predicted curves at one channel: force, N, frequencies, Hz, and what is read per force."""
    found = []
    for branch in branches:
        if channel.name in branch["response"]:
            frequency_Hz = np.array(branch["frequency_Hz"], float)
            response = np.array(branch["response"][channel.name]["amplitude"], float) / branch["force_N"]
            found.append((branch["force_N"], frequency_Hz, per_force(response, channel.quantity, frequency_Hz)))
    return found


def farthest_response(channels: Iterable[Channel]) -> Channel | None:
    """The response channel farthest along the structure, one of motion if there is any; None without any response."""
    responses = [channel for channel in channels if is_response(channel.quantity)]
    motions = [channel for channel in responses if is_motion(channel.quantity)]
    return max(motions or responses, key=lambda channel: channel.position_m or 0.0, default=None)
