"""A run in words and tables, for a text pane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from recordings.quantities import quantity
from recordings.run import Run
from twin.views.curves import SteppedSweep, largest_receptance
from twin.views.style import unit_text

__all__ = ["run_markdown"]


def run_markdown(run: Run, reduced: Sequence[SteppedSweep], rehearsal: Mapping[str, Any] | None) -> str:
    """What the run is, its channels, its sweeps, and a rehearsal's warnings."""
    info = run.info
    title = " · ".join(info[key] for key in ("rig", "procedure") if info.get(key)) or "Run"
    lines = [f"# {title}", ""]
    lines += [
        f"- {key}: {info[key]}" for key in ("source", "stored", "started", "preload_N", "preload_Nm") if key in info
    ]
    lines += ["", "| channel | range | at | lost |", "|---|---|---|---|"]
    for name, channel in run.channels.items():
        unit = unit_text(channel.unit)
        span = f"±{channel.range:g} {unit}" if channel.range else unit
        place = f"{channel.position_m:g} m" if channel.position_m is not None else ""
        try:
            lost = int(np.isnan(run.device_of(name).values[name]).sum())
        except KeyError:
            lost = 0
        lines.append(f"| {name} | {span} | {place} | {lost} |")
    if reduced:
        lines += ["", "| sweep | steps | peak at | receptance |", "|---|---|---|---|"]
    for sweep in reduced:
        if len(sweep.receptance):
            name, sizes = largest_receptance(run, sweep)
            unit = quantity(run.channels[name].quantity).pictured
            peak = int(np.argmax(sizes))
            lines.append(
                f"| {sweep.name} | {len(sizes)} | {sweep.frequency_Hz[peak]:.6g} Hz "
                f"| {sizes[peak]:.4g} {unit}/N ({name}) |"
            )
    warnings = (rehearsal or {}).get("warnings") or []
    if rehearsal is not None:
        lines += ["", "## Warnings of the rehearsal", ""]
        lines += [f"- **{w['kind']}** ({w['severity']}, {w['sweep']}): {w['reason']}; {w['advice']}" for w in warnings]
        lines += [] if warnings else ["none"]
    return "\n".join(lines)
