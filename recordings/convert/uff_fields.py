"""Header fields of data set 58: a channel of a run to them and back."""

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any
from urllib.parse import quote, unquote

from recordings.container.metadata import channel_record, parse_channel
from recordings.directions import axis_number
from recordings.quantities import known_quantities, quantity, quantity_of_unit
from recordings.run import Channel

LINE_LENGTH = 80
REACTION_FORCE = 9
"""Specific data type of a force that nobody applied."""
AXES = {sign * number: f"{'-' if sign < 0 else '+'}{axis}" for number, axis in enumerate("xyz", 1) for sign in (1, -1)}
"""Directions by the number that data set 58 gives them."""


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
        "rsp_node": node, "rsp_dir": axis_number(channel.direction), "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_lab": "time",
        "abscissa_axis_units_lab": "s", "ordinate_spec_data_type": _specific(channel.quantity),
        "ordinate_axis_lab": channel.quantity, "ordinate_axis_units_lab": channel.unit,
        "orddenom_spec_data_type": 0,
    }  # fmt: skip


def channel_of(fields: Mapping[str, Any], measured: str, name: str) -> Channel:
    """The channel of a data set; what the text lines do not tell is left open.

    Raises
    ------
    ValueError
        With the reason, if the text lines contradict the recording contract.
    """
    pairs = text_pairs(fields)
    record = {
        "quantity": measured, "unit": quantity(measured).unit, "device": pairs.get("device", "uff"),
        "direction": pairs.get("direction", AXES.get(int(fields["rsp_dir"]), "+y")),
    }  # fmt: skip
    record |= {key: pairs[key] for key in ("position_m", "range") if key in pairs}
    return parse_channel(name, record)


def quantity_of(fields: Mapping[str, Any]) -> tuple[str, float] | None:
    """Quantity of a data set and the factor to its SI unit; None if no channel of a run can hold it."""
    unit = str(fields["ordinate_axis_units_lab"]).strip()
    label = str(fields["ordinate_axis_lab"]).strip()
    known = known_quantities()
    if label in known and known[label].unit == unit:
        return label, 1.0
    if unit.lower() in ("", "none"):
        code = int(fields["ordinate_spec_data_type"])
        if code == REACTION_FORCE:
            return "force", 1.0
        found = next((one.name for one in known.values() if code and one.uff == code), None)
        return None if found is None else (found, 1.0)  # the format's own default is SI
    return quantity_of_unit(unit)


def _specific(name: str) -> int:
    found = known_quantities().get(name)
    return 0 if found is None else found.uff


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
