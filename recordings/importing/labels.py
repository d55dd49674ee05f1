"""Columns' labels of other programs, such as ``Force [N]``, ``acc1_m_per_s2`` and ``Kraft / N``, taken apart."""

import re

from recordings.quantities import quantity_of_unit

TIME_UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6,
    "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip
"""In seconds, by label in lower case."""
_TIMES = re.compile(r"(elapsed|relative|rel|sample|x)?[ _.-]*(time|zeit|temps|tiempo|tempo|t|timestamp|times|datetime)")
_BRACKETS = re.compile(r"^(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})\s*$")
_SEPARATORS = ",;_/ "


def unit_known(label: str) -> bool:
    """Whether a label is a unit's, of a quantity or of time."""
    return label.strip().lower() in TIME_UNITS or quantity_of_unit(label) is not None


def split_label(label: str) -> tuple[str, str]:
    """Name and unit of a column's label; the unit is empty where there is none."""
    label = label.strip()
    if found := _BRACKETS.match(label):
        name, square, *others = found.groups()
        unit = next((each for each in (square, *others) if each is not None), "")
        if unit_known(unit) or square is not None or not unit:
            return name.strip() or label, unit.strip()
        return label, ""
    for at, character in enumerate(label):
        tail = label[at + 1 :].strip(_SEPARATORS)
        if at and character in _SEPARATORS and unit_known(tail):
            if tail == "A" and character in " _":  # sensor A
                return label, ""
            head = label[:at].strip(_SEPARATORS)
            return (head.removesuffix(" in").strip(), tail) if head else (label, "")
    return label, ""


def is_time(name: str, unit: str) -> bool:
    """Whether a column of that name and unit is the time."""
    unit = unit.strip().lower()
    if unit:
        return unit in TIME_UNITS and (unit not in ("min", "h") or bool(_TIMES.fullmatch(name.strip().lower())))
    return bool(_TIMES.fullmatch(name.strip().lower()))


def channel_name(label: str) -> str:
    """A channel's name from a column's: small letters and digits, as rig files name sensors."""
    return re.sub(r"[^\w.-]+", "_", label.strip().lower()).strip("_") or "channel"
