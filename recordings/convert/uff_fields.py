"""Header fields of data set 58: a channel of a run to them and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any
from urllib.parse import quote, unquote

from recordings.metadata import QUANTITY_UNITS, channel_record, parse_channel
from recordings.run import Channel

__all__ = ["channel_of", "fields_of", "quantity_in", "quantity_of", "start_ns_of", "text_pairs"]

LINE_LENGTH = 80
STANDARD_GRAVITY = 9.80665
_SPECIFIC = {"acceleration": 12, "force": 13, "velocity": 11, "displacement": 8, "temperature": 5}
"""Specific data types of the format; 0 is unknown."""
_QUANTITIES = {code: quantity for quantity, code in _SPECIFIC.items()} | {9: "force"}
_UNITS: dict[str, tuple[str, float]] = {
    "n": ("force", 1.0), "kn": ("force", 1e3),
    "m/s^2": ("acceleration", 1.0), "m/s2": ("acceleration", 1.0), "m/s²": ("acceleration", 1.0),
    "m/s**2": ("acceleration", 1.0), "g": ("acceleration", STANDARD_GRAVITY),
    "m/s": ("velocity", 1.0), "mm/s": ("velocity", 1e-3),
    "m": ("displacement", 1.0), "mm": ("displacement", 1e-3),
    "v": ("voltage", 1.0), "mv": ("voltage", 1e-3), "a": ("current", 1.0),
    "degc": ("temperature", 1.0), "°c": ("temperature", 1.0),
}  # fmt: skip
"""Unit labels in lower case: the quantity they mean and the factor to its SI unit."""


def fields_of(
    channel: Channel, node: int, info: Mapping[str, str], sample_rate_Hz: float, start_ns: int, first_index: int
) -> dict[str, Any]:
    """Header of a time history for pyuff, less its data.

    Raises
    ------
    ValueError
        If a name is too long for a text line.
    """
    record = channel_record(channel)
    lines = {
        "id1": channel.name,
        "id2": _line({"device": channel.device, "source": info["source"], "first_index": str(first_index)}),
        "id3": datetime.fromtimestamp(start_ns // 1_000_000_000, UTC).strftime("%d-%b-%y %H:%M:%S"),
        "id4": _line({key: record[key] for key in ("position_m", "direction", "range") if key in record}),
        "id5": _line({"sample_rate_Hz": repr(float(sample_rate_Hz)), "start_ns": str(start_ns)}),
    }
    for line in lines.values():
        if len(line) > LINE_LENGTH or not line.isprintable():
            raise ValueError(f"channel {channel.name!r:.80}: {line!r:.100} does not fit a line of a universal file")
    short_name = channel.name.encode("ascii", "replace")[:10].decode()
    return {
        "type": 58, "binary": 1, "func_type": 1, **lines, "rsp_ent_name": short_name,
        "rsp_node": node, "rsp_dir": -2 if channel.direction == "-y" else 2, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_lab": "time",
        "abscissa_axis_units_lab": "s", "ordinate_spec_data_type": _SPECIFIC.get(channel.quantity, 0),
        "ordinate_axis_lab": channel.quantity, "ordinate_axis_units_lab": channel.unit,
        "orddenom_spec_data_type": 0,
    }  # fmt: skip


def channel_of(fields: Mapping[str, Any], quantity: str, name: str) -> Channel:
    """The channel of a data set; what the text lines do not tell is left open.

    Raises
    ------
    ValueError
        With the reason, if the text lines contradict the recording contract.
    """
    pairs = text_pairs(fields)
    record = {
        "quantity": quantity, "unit": QUANTITY_UNITS[quantity], "device": pairs.get("device", "uff"),
        "direction": pairs.get("direction", "-y" if fields["rsp_dir"] == -2 else "+y"),
    }  # fmt: skip
    record |= {key: pairs[key] for key in ("position_m", "range") if key in pairs}
    return parse_channel(name, record)


def quantity_of(fields: Mapping[str, Any]) -> tuple[str, float] | None:
    """Quantity of a data set and the factor to its SI unit; None if no channel of a run can hold it."""
    unit = str(fields["ordinate_axis_units_lab"]).strip()
    label = str(fields["ordinate_axis_lab"]).strip()
    if QUANTITY_UNITS.get(label) == unit:
        return label, 1.0
    if unit.lower() in ("", "none"):
        quantity = _QUANTITIES.get(int(fields["ordinate_spec_data_type"]))
        return None if quantity is None else (quantity, 1.0)  # the format's own default is SI
    return quantity_in(unit)


def quantity_in(unit: str) -> tuple[str, float] | None:
    """Quantity that a unit's label means and the factor to its SI unit; None if it is not known."""
    return _UNITS.get(unit.strip().lower())


def start_ns_of(fields: Mapping[str, Any]) -> int:
    """When the first sample was taken: from the text lines, from the usual date line, or from 1970 on."""
    pairs = text_pairs(fields)
    if "start_ns" in pairs:
        start_ns = int(pairs["start_ns"])
    else:
        try:
            date = datetime.strptime(str(fields["id3"]).strip(), "%d-%b-%y %H:%M:%S").replace(tzinfo=UTC)
            start_ns = round(date.timestamp()) * 1_000_000_000
        except ValueError:
            start_ns = 0
        offset = float(fields["abscissa_min"])
        start_ns += round(offset * 1e9) if math.isfinite(offset) and abs(offset) < 1e9 else 0
    if not 0 <= start_ns < 1 << 62:
        raise ValueError(f"starts at {start_ns} ns")
    return start_ns


def text_pairs(fields: Mapping[str, Any]) -> dict[str, str]:
    """``key=value`` pairs of the text lines."""
    text = ";".join(str(fields[name]) for name in ("id2", "id4", "id5"))
    return {
        key.strip(): unquote(value.strip())
        for key, separator, value in (pair.partition("=") for pair in text.split(";"))
        if separator
    }


def _line(pairs: Mapping[str, str]) -> str:
    return ";".join(f"{key}={quote(value, safe=' /+^')}" for key, value in pairs.items()) or "NONE"
