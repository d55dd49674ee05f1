"""What a recording's metadata and its attached rig file say, against the rig that it is held against."""

import tomllib
from collections.abc import Sequence
from datetime import datetime

from recordings.run import Run
from twin.checks.finding import Finding
from twin.checks.thresholds import PLACE_m
from twin.rigs import Rig, nearest_preload, recorded_preload
from twin.rigs.limits import LIMITS

DAY_s = 86400.0


def look_at_metadata(run: Run, rig: Rig, *, preload: str | None) -> list[Finding]:
    """Quantities, positions, the rig's name and the preload.

    Parameters
    ----------
    preload
        The one that was asked for; None for the recording's.
    """
    findings = [*_rig(run, rig), *_preload(run, rig, preload), *_names(run, rig)]
    for sensor in rig.sensor:
        channel = run.channels.get(sensor.channel)
        if channel is None:
            continue
        if channel.quantity != sensor.quantity:
            found = f"the file says {channel.quantity} in {channel.unit}"
            expected = f"{sensor.quantity}, as rig {rig.name} says"
            findings.append(Finding(run.path, channel.name, "quantity", expected, found, "stopped"))
        place, recorded = rig.layout().position(rig.place_of(sensor.channel)), channel.position_m
        if place is not None and recorded is not None and abs(place - recorded) > PLACE_m:
            found = f"the file says {recorded:g} m"
            expected = f"{place:.4g} m, as rig {rig.name} says and as is used"
            findings.append(Finding(run.path, channel.name, "position", expected, found, "told"))
    return findings


def look_at_days(runs: Sequence[Run]) -> list[Finding]:
    """Runs that were recorded days from the others: what has changed since then looks like a drift."""
    started = {}
    for run in runs:
        try:
            started[run.path] = datetime.fromisoformat(run.info["started"]).timestamp() / DAY_s
        except (KeyError, ValueError, OverflowError):
            continue  # a contract's key that old files leave out
    started = {path: day for path, day in started.items() if day > 1}  # 1970: not known
    usual = sorted(started.values())[len(started) // 2] if started else 0.0
    return [
        Finding(
            path, "", "specimen", "runs of one day",
            f"recorded {abs(day - usual):.3g} days {'after' if day > usual else 'before'} the others: "
            "another specimen, or a change since?", "told",
        )
        for path, day in started.items() if abs(day - usual) > 1
    ]  # fmt: skip


def _rig(run: Run, rig: Rig) -> list[Finding]:
    named = {"the file": run.info.get("rig", "")}
    try:
        attached = tomllib.loads(run.attachments.get("rig.toml", b"").decode())
        named["its rig.toml"] = str(attached.get("name", ""))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        pass  # an attachment is a copy for people, kept as it is
    other = {name: who for who, name in named.items() if name and name != rig.name}
    return [
        Finding(run.path, "", "rig", f"rig {rig.name}", f"{who} names rig {name}", "told")
        for name, who in list(other.items())[:1]
    ]


def _names(run: Run, rig: Rig) -> list[Finding]:
    """Sensors that the file may have by another name: they are missing, and it has a channel that the rig has not."""
    findings = []
    known = {sensor.channel for sensor in rig.sensor}
    for sensor in rig.response_sensors:
        others = [c.name for c in run.channels.values() if c.quantity == sensor.quantity and c.name not in known]
        if sensor.channel not in run.channels and others:
            found = f"the file has {', '.join(others)}, which the rig has not and which is not used"
            findings.append(
                Finding(run.path, sensor.channel, "name", f"{sensor.channel}, as the rig says", found, "told")
            )
    return findings


def _preload(run: Run, rig: Rig, preload: str | None) -> list[Finding]:
    """Where another preload was asked for than was recorded; one that the rig has not is told with the answer."""
    recorded = recorded_preload(run.info)
    nearest, departure = nearest_preload(rig, run.info)
    if preload is None or recorded is None or nearest == preload or abs(departure) > LIMITS.preloads_near:
        return []
    found = f"the file says {recorded[0]:g} {recorded[1]}"
    return [Finding(run.path, "", "preload", f"{preload}, as was asked for", found, "told")]
