"""Runs as the dictionaries that the sdypy packages pass to each other, and back.

SDyPy Enhancement Proposal 5 (https://github.com/sdypy/sdypy/blob/main/docs/seps/sep-0005.rst) asks for a dictionary a
channel: ``data``, ``name``, ``unit_str``, and ``fs`` or ``time``; it allows more keys.  ``quantity`` is f, a, v or d.
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.container.metadata import parse_channel, run_record
from recordings.convert.blocks import device_from_rows, to_float32
from recordings.errors import InputError, blamed_on
from recordings.quantities import known_quantities, quantity_of_unit
from recordings.run import Channel, DeviceSamples, Run

STRAY = 0.5
"""Sampling intervals by which samples may be early or late and still be told by a sampling frequency alone."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def to_sep005(run: Run, *, start_ns: int | None = None, stop_ns: int | None = None) -> list[dict[str, Any]]:
    """Every channel of a run as a SEP-0005 dictionary, in SI units.

    Parameters
    ----------
    start_ns, stop_ns
        Only what was sampled from here to before there, such as the bounds of a :class:`recordings.Stretch`; all if
        left out.

    Returns
    -------
    list of dict
        ``data`` (n,) float64, lost samples NaN and counted in ``lost_samples``; ``name``; ``unit_str``; ``quantity``
        where the proposal has a letter for it; ``start_timestamp``; ``group``, the device.  ``fs`` (Hz, an int where
        it is whole, as pyFRF wants) if that tells the time of every sample within half an interval; if clocks stepped
        or samples were left out, ``time`` (s, from the first) instead.  Beyond the proposal, ``start_ns`` (exact) and
        the contract's ``measures``, ``position_m``, ``direction`` and ``range``.
    """
    series = []
    for device in run.devices.values():
        first = 0 if start_ns is None else device.position_at(start_ns)
        last = len(device) if stop_ns is None else device.position_at(stop_ns)
        if first >= last:
            continue
        timing = _timing(device, device.times_ns(first, last))
        for name, values in device.values.items():
            data = values[first:last].astype(np.float64)
            lost = int(np.isnan(data).sum())
            series.append({"data": data, **_naming(run.channels[name]), **timing, "lost_samples": lost})
    return series


def _timing(device: DeviceSamples, times_ns: NDArray[np.int64]) -> dict[str, Any]:
    """When the samples were taken, as briefly as it can be said."""
    rate_Hz, start_ns = device.sample_rate_Hz, int(times_ns[0])
    started = _EPOCH + timedelta(microseconds=start_ns // 1000)
    told = {"start_timestamp": started.isoformat(), "start_ns": start_ns}
    time_s = (times_ns - start_ns) * 1e-9
    if np.abs(time_s * rate_Hz - np.arange(len(time_s))).max() > STRAY:
        return {"time": time_s.tolist(), **told}
    return {"fs": int(rate_Hz) if rate_Hz == int(rate_Hz) else rate_Hz, **told}


def _naming(channel: Channel) -> dict[str, Any]:
    named = {
        "name": channel.name, "unit_str": channel.unit, "quantity": _letter(channel.quantity),
        "group": channel.device, "measures": channel.quantity, "position_m": channel.position_m,
        "direction": channel.direction, "range": channel.range,
    }  # fmt: skip
    return {key: value for key, value in named.items() if value is not None}


def from_sep005(timeseries: Mapping[str, Any] | Sequence[Mapping[str, Any]], *, source: str = "SEP-0005") -> Run:
    """A run from SEP-0005 dictionaries, as the sdypy readers of other formats give them.

    Units become SI.  Channels of one ``group`` are one device and must have been sampled together; NaN are samples
    that were lost.

    Parameters
    ----------
    timeseries
        One dictionary or several; each needs ``fs``.
    source
        What to call them in errors.

    Raises
    ------
    InputError
        With the channel, if it lacks what is needed, or is in no unit that a run has.
    """
    groups: dict[str, list[_Series]] = {}
    channels: dict[str, Channel] = {}
    for number, one in enumerate([timeseries] if isinstance(timeseries, Mapping) else timeseries, start=1):
        with blamed_on(source, f"channel {one.get('name', number)!s:.80}", of=(ValueError, TypeError, OverflowError)):
            series = _Series(one)
            if series.channel.name in channels:
                raise ValueError("stands twice")
        channels[series.channel.name] = series.channel
        groups.setdefault(series.channel.device, []).append(series)
    if not channels:
        raise InputError(source, "", "holds no channel")
    devices = {name: device for name, parts in groups.items() if (device := _device(source, name, parts)) is not None}
    start_ns = min(series.start_ns for parts in groups.values() for series in parts)
    return Run(path=source, info=run_record(start_ns), channels=channels, devices=devices, steps=(), events=())


def _letter(name: str) -> str | None:
    found = known_quantities().get(name)
    return found.letter or None if found is not None else None


class _Series:
    """One dictionary, checked and in SI units."""

    def __init__(self, one: Mapping[str, Any]) -> None:
        missing = [key for key in ("data", "name", "unit_str", "fs") if one.get(key) is None]
        if missing:
            uneven = "; it is not evenly sampled" if missing[0] == "fs" and "time" in one else ""
            raise ValueError(f"has no {missing[0]!r}{uneven}")
        quantity, factor = _quantity(one)
        record = {
            "quantity": quantity, "unit": known_quantities()[quantity].unit,
            "device": str(one.get("group") or "sep005"),
            "direction": str(one.get("direction", "+y")),
        }  # fmt: skip
        if one.get("position_m") is not None:
            record["position_m"] = repr(float(one["position_m"]))
        if one.get("range") is not None:
            record["range"] = repr(float(one["range"]) * factor)
        self.channel = parse_channel(str(one["name"]), record)
        data = np.asarray(one["data"], dtype=np.float64)
        if data.ndim != 1 or not len(data):
            raise ValueError(f"its data have the shape {data.shape}, not (n,)")
        self.values = to_float32(data * factor)
        self.sample_rate_Hz = float(one["fs"])
        if not 0 < self.sample_rate_Hz < 1e12:
            raise ValueError(f"a sample rate of {self.sample_rate_Hz} Hz")
        self.start_ns = int(one["start_ns"]) if "start_ns" in one else _nanoseconds(one.get("start_timestamp"))
        if not 0 <= self.start_ns < 1 << 62:
            raise ValueError("does not start between 1970 and 2116")


def _quantity(one: Mapping[str, Any]) -> tuple[str, float]:
    """What is measured, and the factor to its SI unit."""
    unit = str(one["unit_str"])
    found = quantity_of_unit(unit)
    if found is None:
        raise ValueError(f"a run cannot hold the unit {unit!r:.40}")
    quantity, factor = found
    known, letter = known_quantities(), one.get("quantity")
    by_letter = next((each.name for each in known.values() if letter and each.letter == letter), quantity)
    said = str(one.get("measures") or by_letter)
    if said not in known or known[said].unit != known[quantity].unit:
        raise ValueError(f"is said to be {said!r:.40}, but its unit is {unit!r:.40}")
    return said, factor


def _nanoseconds(stamp: object) -> int:
    if stamp is None:
        return 0
    moment = stamp if isinstance(stamp, datetime) else datetime.fromisoformat(str(stamp))
    since = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)) - _EPOCH
    return since // timedelta(microseconds=1) * 1000


def _device(source: str, name: str, parts: Sequence[_Series]) -> DeviceSamples | None:
    place, first = f"group {name:.80}", parts[0]
    together = {(len(each.values), each.sample_rate_Hz, each.start_ns) for each in parts}
    if len(together) > 1:
        reason = "its channels differ in length, sampling frequency or start"
        raise InputError(source, place, reason, "give each its own 'group'")
    kept = np.flatnonzero(np.any([~np.isnan(each.values) for each in parts], axis=0))
    time_ns = first.start_ns + np.rint(kept * (1e9 / first.sample_rate_Hz)).astype(np.int64)
    values = {each.channel.name: each.values[kept] for each in parts}
    with blamed_on(source, place):
        return device_from_rows(name, first.sample_rate_Hz, kept, time_ns, values, {})
