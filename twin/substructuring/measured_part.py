"""Receptances between the points of a part that is known by its responses, from the file that the rig file names."""

from collections.abc import Mapping
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np

from recordings.errors import InputError, blamed_on
from recordings.quantities import quantity
from recordings.responses import End, FoundResponse, are_responses, read_responses
from twin.arrays import Array
from twin.identify.responses.reduction import noise_of
from twin.rigs.substructures import MeasuredPart, SubstructuresRig
from twin.substructuring.limits import LIMITS
from twin.substructuring.synthesis import Synthesis, synthesise

Measured = dict[tuple[str, str], list[tuple[float, FoundResponse]]]
"""Responses with their signs by the two points, in the order of their names."""


def measured_receptance(rig: SubstructuresRig, part: MeasuredPart, axes: Mapping[str, str]) -> tuple[Array, Synthesis]:
    """Lines (f,), Hz, and synthesis of a measured part.

    InputError if the file lacks a pair of points, a unit or common lines, or nothing can be synthesised.

    Parameters
    ----------
    axes
        Points that are needed, and the axis along which each moves.
    """
    path = rig.layout().file(part.responses, f"measured_part {part.name!r}")
    if not path.is_file():
        raise InputError(path, "", "there is no such file", f"measured_part {part.name!r} names it")
    if not are_responses(path):
        raise InputError(path, "", "is no file of frequency responses", "give .uff, .unv, .npz or .csv")
    if len(axes) > LIMITS.most_points:
        raise InputError(path, "", f"{len(axes)} points are too many", f"use {LIMITS.most_points} at most")
    found = _by_points(path, axes)
    lines = next(iter(found.values()))[0][1].frequency_Hz if found else np.zeros(0)
    omega, names = 2 * np.pi * lines, list(axes)
    Y = np.zeros((len(lines), len(names), len(names)), complex)
    variance = np.zeros(Y.shape)
    for j, k in combinations_with_replacement(range(len(names)), 2):
        both = found.get((min(names[j], names[k]), max(names[j], names[k])), [])
        if not both:
            raise InputError(
                path, "", f"has no response of {names[j]} to a force at {names[k]}, nor the other way round",
                f"part {part.name!r} needs all pairs of {', '.join(names)}",
            )  # fmt: skip
        for _, one in both:
            if not same_lines(one.frequency_Hz, lines):
                raise InputError(path, one.place, "has other lines than the first response", "export all on one axis")
        mean = np.mean([s * one.H / (1j * omega) ** quantity(one.quantity).derivative for s, one in both], axis=0)
        relative = np.mean([noise_of(one) for _, one in both], axis=0) / len(both)
        Y[:, j, k] = Y[:, k, j] = mean
        variance[:, j, k] = variance[:, k, j] = np.maximum(relative, np.finfo(float).eps) * np.abs(mean) ** 2
    with blamed_on(path):
        return lines, synthesise(lines, Y, np.sqrt(variance))


def same_lines(one: Array, other: Array) -> bool:
    """Whether two responses have the same frequencies (f,), Hz."""
    return len(one) == len(other) and bool(np.allclose(one, other))


def _by_points(path: Path, axes: Mapping[str, str]) -> Measured:
    """The file's responses between the points; of a pair both ways, as hammer and sensor may change places."""
    found: Measured = {}
    for one in read_responses(path).responses:
        ends = [one.response, one.reference]
        names = [_name(end) for end in ends]
        if not set(names) <= set(axes):
            continue
        if not one.quantity or quantity(one.quantity).reads != "displacement":
            raise InputError(path, one.place, "says no unit", "label it, (m/s^2)/N, or give frf_form")
        signs = [_sign(path, one, end, axes[name]) for end, name in zip(ends, names, strict=True)]
        found.setdefault((min(names), max(names)), []).append((signs[0] * signs[1], one))
    return found


def _name(end: End) -> str:
    """Of a point: its channel's name, else its node's number."""
    return end.name or str(end.node)


def _sign(path: Path, one: FoundResponse, end: End, axis: str) -> float:
    """Of an end along an axis; 1 where the file says no direction."""
    if end.direction and end.direction[1:] != axis:
        told = f"{end.told} does not move along {axis}, in which it is joined"
        raise InputError(path, one.place, told, "join the direction that was measured")
    return -1.0 if end.direction.startswith("-") else 1.0
