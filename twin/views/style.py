"""Colours, units and ticks that all pictures share."""

import math

INK = "#1a1a1a"
MEASURED, BEFORE, AFTER = "#1a1a1a", "#d55e00", "#0072b2"
NOISE = "#5f5f5f"
CAUTION = "#a56a00"
"""Beside an answer that needs care."""
KIND = {"measured": MEASURED, "before": BEFORE, "after": AFTER, "model": AFTER}
"""The kinds of a curve wherever levels are not told apart; `model` where there is but one."""
LEVELS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#5f5f5f")
"""One for each level; most of them from Okabe and Ito's palette, which colour-blind readers can tell apart."""


def level_colour(index: int) -> str:
    """Colour of the level with this number."""
    return LEVELS[index % len(LEVELS)]


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def unit_text(unit: str) -> str:
    """A unit as it is printed."""
    return unit.replace("^2", "²").replace("^3", "³").replace("*", "·")


ON_DARK = {
    INK: "#f2f2f2",
    "#0072b2": "#56b4e9",
    "#d55e00": "#ff8c42",
    "#009e73": "#2ecfa0",
    "#cc79a7": "#e6a1cb",
    "#e69f00": "#f0c419",
    "#56b4e9": "#a9d9f5",
    "#8c564b": "#c9a28f",
    "#5f5f5f": "#b0b0b0",
}


def on_dark(colour: str) -> tuple[int, int, int]:
    """The same colour, bright enough for the viewer's dark ground."""
    return rgb(ON_DARK.get(colour, colour))


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def tick_text(value: float) -> str:
    """A tick's number; powers of ten that would be long are written as such."""
    if value > 0 and not 1e-3 < value < 9e4 and math.isclose(power := math.log10(value), round(power), abs_tol=1e-9):
        return "10" + str(round(power)).translate(SUPERSCRIPTS)
    return f"{value:g}"


def ticks(low: float, high: float, *, log: bool = False, most: int = 7) -> list[float]:
    """Round numbers from `low` to `high`: powers of ten (with 2 and 5 where there is room), or steps of 1, 2 or 5."""
    if log:
        first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
        parts = (1.0, 2.0, 5.0) if last - first <= 2 else (1.0,)
        stride = max(1, math.ceil((last - first) / most))
        found = [part * 10.0**power for power in range(first, last + 1, stride) for part in parts]
    else:
        rough = (high - low) / most
        base = 10.0 ** math.floor(math.log10(rough))
        step = next(factor * base for factor in (1, 2, 5, 10) if factor * base >= rough)
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        found = [step * number for number in range(first, last + 1)]
    return [value for value in found if low * (1 - 1e-9) - 1e-300 <= value <= high * (1 + 1e-9) or low <= value <= high]
