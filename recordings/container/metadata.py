"""The metadata records of a run: ``run`` and ``channel/<name>``, strings to strings."""

import math
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta

from recordings.directions import direction_name, unit_vector
from recordings.quantities import quantity
from recordings.run import Channel

RUN, CHANNEL_PREFIX = "run", "channel/"
FORMAT = "1"
_SOURCES = ("measured", "simulated", "replayed")
_STORED = ("all", "settled")
_REQUIRED = ("format", "source", "rig", "procedure", "started")


def run_record(start_ns: int, **more: str) -> dict[str, str]:
    """The ``run`` record of what was measured from a time on; a key of `more` stands in place of the usual."""
    started = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=start_ns // 1000)
    return {
        "format": FORMAT, "source": "measured", "stored": "all", "rig": "", "procedure": "",
        "started": started.isoformat(timespec="milliseconds").replace("+00:00", "Z"), **more,
    }  # fmt: skip


def parse_run(record: Mapping[str, str]) -> dict[str, str]:
    """The ``run`` record, checked; ``stored`` is filled in where it is missing, unknown keys are kept.

    Raises
    ------
    ValueError
        With the reason, if the record breaks the contract.
    """
    missing = [key for key in _REQUIRED if key not in record]
    if missing:
        raise ValueError(f"no key {missing[0]!r}")
    if record["format"] != FORMAT:
        raise ValueError(f"format {record['format']!r:.80}, this program reads format '1'")
    info = {"stored": "all", **record}
    for key, allowed in (("source", _SOURCES), ("stored", _STORED)):
        if info[key] not in allowed:
            raise ValueError(f"{key} is {info[key]!r:.80}, not one of {', '.join(allowed)}")
    try:
        offset = datetime.fromisoformat(info["started"]).utcoffset()
    except ValueError:
        raise ValueError(f"started is {info['started']!r:.80}, not a time in ISO 8601") from None
    if offset:
        raise ValueError(f"started is {info['started']!r:.80}, not in UTC")
    for key in ("preload_N", "preload_Nm"):
        if key in info:
            _number(info, key)
    return info


def parse_channel(name: str, record: Mapping[str, str]) -> Channel:
    """A ``channel/<name>`` record.

    ``position_m`` and ``range`` may be missing (a temperature has no place along the beam), ``direction`` is then +y.

    Raises
    ------
    ValueError
        With the reason, if the record breaks the contract.
    """
    missing = [key for key in ("quantity", "unit", "device") if not record.get(key)]
    if not name:
        raise ValueError("a channel without a name")
    if missing:
        raise ValueError(f"no key {missing[0]!r}")
    measured, unit = quantity(record["quantity"]), record["unit"]
    if unit != measured.unit:
        raise ValueError(f"unit of {measured.name} is {unit!r:.80}, not {measured.unit!r}")
    direction = direction_name(unit_vector(record.get("direction", "+y")))
    limit = _number(record, "range") if record.get("range") else None
    if limit is not None and limit <= 0:
        raise ValueError(f"range is {limit!r}, not above zero")
    return Channel(
        name=name, quantity=measured.name, unit=unit, direction=direction, range=limit, device=record["device"],
        position_m=_number(record, "position_m") if record.get("position_m") else None,
    )  # fmt: skip


def channel_record(channel: Channel) -> dict[str, str]:
    """What `parse_channel` reads back as the same channel."""
    record = {"quantity": channel.quantity, "unit": channel.unit}
    if channel.position_m is not None:
        record["position_m"] = repr(float(channel.position_m))
    record["direction"] = channel.direction
    if channel.range is not None:
        record["range"] = repr(float(channel.range))
    record["device"] = channel.device
    return record


def _number(record: Mapping[str, str], key: str) -> float:
    try:
        value = float(record[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{key} is {record[key]!r:.80}, not a number")
    return value
