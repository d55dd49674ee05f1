"""A run in words and tables."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from recordings.quantities import quantity
from recordings.run import Run, pieces
from twin.views.curves import SteppedSweep, largest_receptance
from twin.views.reports.rehearsal import warnings_table
from twin.views.style import unit_text
from twin.views.table import Table, markdown_text, table_markdown


def run_tables(run: Run, sweeps: Sequence[SteppedSweep]) -> list[Table]:
    """Channels, the sweeps that were reduced, and events, as far as there are any."""
    tables = (_channels(run), _sweeps(run, sweeps), _events(run))
    return [table for table in tables if table.rows]


def _channels(run: Run) -> Table:
    rows = []
    for name, channel in run.channels.items():
        unit = unit_text(channel.unit)
        span = f"±{channel.range:g} {unit}" if channel.range else unit
        place = f"{channel.position_m:g}" if channel.position_m is not None else ""
        rows.append((name, channel.quantity, span, place, channel.direction, str(_lost(run, name))))
    head = ("channel", "quantity", "range", "at, m", "direction", "lost samples")
    return Table(caption="Channels", head=head, rows=rows, numbers=(3, 5))


def _lost(run: Run, channel: str) -> int:
    try:
        return sum(int(np.isnan(part).sum()) for part in pieces(run.device_of(channel).values[channel]))
    except KeyError:
        return 0


def _sweeps(run: Run, sweeps: Sequence[SteppedSweep]) -> Table:
    rows = []
    for sweep in sweeps:
        if sweep.receptance:
            channel, sizes = largest_receptance(run, sweep)
            unit, peak = quantity(run.channels[channel].quantity).pictured, int(np.argmax(sizes))
            largest = f"{sizes[peak]:.4g} {unit}/N ({channel})"
            rows.append((sweep.name, str(len(sizes)), f"{sweep.frequency_Hz[peak]:.6g}", largest))
    return Table(caption="Sweeps", head=("sweep", "steps", "peak at, Hz", "receptance"), rows=rows, numbers=(1, 2))


def _events(run: Run) -> Table:
    counts = Counter((event.source, event.kind) for event in run.events)
    rows = [(source, kind, str(count)) for (source, kind), count in counts.items()]
    return Table(caption="Events", head=("source", "kind", "how often"), rows=rows, numbers=(2,))


def run_markdown(run: Run, reduced: Sequence[SteppedSweep], rehearsal: Mapping[str, Any] | None) -> str:
    """What the run is, its tables, and a rehearsal's warnings."""
    info = run.info
    title = " · ".join(info[key] for key in ("rig", "procedure") if info.get(key)) or "Run"
    known = [key for key in ("source", "stored", "started", "preload_N", "preload_Nm") if key in info]
    blocks = [f"# {markdown_text(title)}", "\n".join(f"- {key}: {markdown_text(info[key])}" for key in known)]
    blocks += map(table_markdown, run_tables(run, reduced))
    if rehearsal is not None:
        warnings = warnings_table(rehearsal)
        blocks += ["## Warnings of the rehearsal", table_markdown(warnings) if warnings.rows else "none"]
    return "\n\n".join(blocks)
