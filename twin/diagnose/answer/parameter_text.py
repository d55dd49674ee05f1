"""Parameters of causes in words and engineering units: ``mass 13.63 ± 0.03 g at 357.0 ± 0.7 mm``."""

from collections.abc import Mapping

import numpy as np

from twin.identify.estimate import Estimate

PREFIXES = {"G": 1e-9, "M": 1e-6, "k": 1e-3, "": 1.0, "m": 1e3, "µ": 1e6, "n": 1e9, "p": 1e12}


def _with_prefixes(prefixes: str, unit: str) -> tuple[tuple[str, float], ...]:
    """The unit with each of these prefixes, and by what a value in the unit itself is to be multiplied."""
    return tuple((f"{prefix.strip()}{unit}", PREFIXES[prefix.strip()]) for prefix in prefixes)


UNITS = {
    "_m": _with_prefixes(" mµn", "m"),
    "_kg": (("kg", 1.0), ("g", 1e3), ("mg", 1e6)),
    "_s": _with_prefixes(" mµn", "s"),
    "_s2": (("s²", 1.0),),
    "_Hz": _with_prefixes(" m", "Hz"),
    "_Hz_per_sweep": _with_prefixes(" m", "Hz per sweep"),
    "_N": _with_prefixes("k mµ", "N"),
    "_N_per_m": _with_prefixes("GMk ", "N/m"),
    "_N_per_m3": _with_prefixes("GMk ", "N/m³"),
    "_Ns_per_m": _with_prefixes(" m", "N s/m"),
    "_Ns2_per_m3": _with_prefixes(" m", "N s²/m³"),
    "_m_per_N": _with_prefixes("mµnp", "m/N"),
    "_rad_per_Nm": _with_prefixes(" mµn", "rad/(N m)"),
    "_per_s": (("%/s", 1e2), ("%/min", 6e3), ("%/h", 3.6e5)),
    "_ppm": (("ppm", 1.0),),
}
"""By the end of a parameter's name, which tells its SI unit: what it is told in, the largest first."""

WORDS = {"position_m": "at", "rotational_rad_per_Nm": "rotational compliance"}
"""Where the name without its unit is not what an engineer would say."""


def parameters_text(parameters: Mapping[str, Estimate | float | str | tuple[int, ...]]) -> str:
    """Parameters in one line, the place last."""
    told = [_told(name, value) for name, value in parameters.items()]
    places = [text for text in told if text.startswith("at ")]
    return " ".join(filter(None, (", ".join(text for text in told if text not in places), *places)))


def size_text(name: str, size: float | None) -> str:
    """A parameter's size to two digits, such as ``mass 4.2 g``; ``any mass`` where it may have any."""
    words, unit, factor = _in_unit(name, size or 0.0)
    if size is None:
        return f"any {words}"
    return _joined(words, f"{float(f'{factor * size:.2g}'):.7g}", unit)


def _told(name: str, value: Estimate | float | str | tuple[int, ...]) -> str:
    if isinstance(value, tuple):
        return f"nodes {', '.join(map(str, value))}"
    if isinstance(value, str):
        return f"{name.replace('_', ' ')} {value}"
    if name == "node":
        return f"at node {value.value if isinstance(value, Estimate) else value:.0f}"
    estimate = value if isinstance(value, Estimate) else Estimate(value, 0.0)
    words, unit, factor = _in_unit(name, estimate.value)
    return _joined(words, str(estimate.scaled(factor)), unit)


def _in_unit(name: str, size: float) -> tuple[str, str, float]:
    """A parameter's name in words, its unit in which the size is at least 1, and what that unit multiplies it by."""
    suffix = max((end for end in UNITS if name.endswith(end)), key=len, default="")
    words = WORDS.get(name, name.removesuffix(suffix).replace("_", " "))
    if not suffix:
        return words, "", 1.0
    units = UNITS[suffix]
    if not np.isfinite(size) or size == 0:
        return words, *next((unit, factor) for unit, factor in units if factor >= 1)
    return words, *next(((unit, factor) for unit, factor in units if abs(size) * factor >= 1), units[-1])


def _joined(words: str, number: str, unit: str) -> str:
    return " ".join(filter(None, (words, number, unit)))
