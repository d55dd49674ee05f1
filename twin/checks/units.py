"""Factors between units that have a name."""

from __future__ import annotations

import math
from collections.abc import Mapping

from recordings.quantities import STANDARD_GRAVITY
from twin.checks.thresholds import NAMED

__all__ = ["OF_FORCE", "OF_RESPONSE", "factor_text", "name_of"]

POUND_FORCE_N = 4.4482216152605
FOOT_m, INCH_m = 0.3048, 0.0254

_ANY = {
    2 * math.pi: "a factor of 2 pi: hertz for rad/s?",
    1 / (2 * math.pi): "a factor of 1 / 2 pi: rad/s for hertz?",
    math.sqrt(2): "a factor of sqrt 2: peak for rms?",
    math.sqrt(0.5): "a factor of 1 / sqrt 2: rms for peak?",
    2.0: "a factor of 2: peak to peak?",
    0.5: "a factor of 0.5: half of peak to peak, or half the amplification?",
    100.0: "a factor of 100: a switch of the amplifier?",
    0.01: "a factor of 0.01: a switch of the amplifier?",
    1e3: "a factor of 1000: milli-units?",
    1e-3: "a factor of 0.001: kilo-units?",
}
OF_RESPONSE: Mapping[float, str] = {
    1 / STANDARD_GRAVITY: "a factor of 1 / 9.81: recorded in g?",
    STANDARD_GRAVITY: "a factor of 9.81: taken for g and converted twice?",
    1 / FOOT_m: "a factor of 3.28: recorded in feet?",
    1 / INCH_m: "a factor of 39.4: recorded in inches?",
    **_ANY,
}
"""Recorded over true value of a response, and what it suggests."""
OF_FORCE: Mapping[float, str] = {
    1 / POUND_FORCE_N: "a factor of 1 / 4.448: recorded in lbf?",
    POUND_FORCE_N: "a factor of 4.448: taken for lbf and converted twice?",
    1 / STANDARD_GRAVITY: "a factor of 1 / 9.81: recorded in kgf?",
    STANDARD_GRAVITY: "a factor of 9.81: taken for kgf and converted twice?",
    **_ANY,
}
"""The same of a force."""


def name_of(factor: float, names: Mapping[float, str]) -> str:
    """What a factor suggests; empty for one without a name."""
    known = min(names, key=lambda one: abs(math.log(factor / one)))
    return names[known] if abs(math.log(factor / known)) < NAMED else ""


def factor_text(factor: float) -> str:
    """It as the end of a phrase."""
    return f", a factor of {factor:.4g}"
