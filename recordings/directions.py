"""Directions of forces and sensors: along an axis, ``+x`` to ``-z``, or a unit vector in space, ``0.6,0.8,0``."""

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator

Vector = tuple[float, float, float]

AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
ROUNDED = 1e-3
"""By so much a unit vector's length may differ from 1: people round to three digits."""
DIGITS = 6
"""Of a component that is written."""


def unit_vector(direction: str | Sequence[float]) -> Vector:
    """A direction as files give it: ``+x``, ``-y``, ``0.6,0.8,0``, or two or three numbers.

    Raises
    ------
    ValueError
        If it is none of these, or the numbers are no unit vector.
    """
    if isinstance(direction, str) and "," not in direction:
        sign, axis = direction[:1], direction[1:]
        if axis not in AXES or sign not in ("+", "-"):
            raise ValueError(f"direction {direction!r:.80} is not +x, -x, +y, -y, +z, -z or a unit vector")
        x, y, z = AXES[axis]
        factor = -1.0 if sign == "-" else 1.0
        return factor * x, factor * y, factor * z
    try:
        values = [float(value) for value in (direction.split(",") if isinstance(direction, str) else direction)]
    except ValueError:
        raise ValueError(f"direction {direction!r:.80} is not +x, -x, +y, -y, +z, -z or a unit vector") from None
    size = math.hypot(*values)
    if len(values) not in (2, 3) or not abs(size - 1) <= ROUNDED:
        raise ValueError(f"direction {direction!r:.80} is not a unit vector")
    x, y, z = [*values, 0.0][:3]
    return x / size, y / size, z / size


def direction_name(vector: Sequence[float]) -> str:
    """A unit vector as recordings write it: ``+x`` where it lies along an axis, else its components to six digits."""
    rounded = [round(value, DIGITS) + 0.0 for value in vector]
    number = axis_number(rounded)
    if abs(rounded[abs(number) - 1]) == 1.0:
        return f"{'-' if number < 0 else '+'}{'xyz'[abs(number) - 1]}"
    return ",".join(f"{value:.{DIGITS}g}" for value in rounded)


def cosine(one: str | Sequence[float], other: str | Sequence[float]) -> float:
    """Of the angle between two directions."""
    return sum(a * b for a, b in zip(unit_vector(one), unit_vector(other), strict=True))


def axis_number(direction: str | Sequence[float]) -> int:
    """The axis nearest to a direction: 1, 2 or 3 for x, y or z, negative where it points against it."""
    vector = unit_vector(direction)
    nearest = max(range(3), key=lambda axis: abs(vector[axis]))
    return -nearest - 1 if vector[nearest] < 0 else nearest + 1


def _is_direction(value: str) -> str:
    return direction_name(unit_vector(value))


Direction = Annotated[str, AfterValidator(_is_direction)]
"""Of a channel, in a file that people write."""


def _kept(value: str | list[float]) -> str | list[float]:
    unit_vector(value)
    return value


Towards = Annotated[str | list[float], AfterValidator(_kept)]
"""The same as it was given, of a place in a rig's file or a procedure's."""
