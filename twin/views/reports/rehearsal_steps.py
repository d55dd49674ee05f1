"""Every step of a rehearsal as tables, one a sweep: what it reached, and how near it came to whatever bounds it."""

from collections.abc import Mapping, Sequence
from typing import Any

from twin.views.page import Section, Table

Row = Mapping[str, Any]


def steps_section(steps: Sequence[Row], title: str) -> Section | None:
    """All steps of a rehearsal's table (``result.json``); None without any."""
    sweeps: dict[str, list[Row]] = {}
    for step in steps:
        sweeps.setdefault(step["sweep"], []).append(step)
    if not sweeps:
        return None
    return Section(
        title=title,
        texts=[
            "Error is that of the held amplitude; the transient is what is left of it in the measurement, relative to "
            "the response; distortion is all higher harmonics over the fundamental; range is the peak over the "
            "converter's limit; distance is what is left to each limit of the procedure.  All in per cent."
        ],
        tables=[_sweep(name, rows) for name, rows in sweeps.items()],
    )


def _sweep(name: str, steps: Sequence[Row]) -> Table:
    distorted, ranged, limited = (_names(steps, field) for field in ("distortion", "range_use", "limit_use"))
    head = ["step", "Hz", "target", "error", "wait, s", "transient"]
    columns = [("distortion", distorted), ("range", ranged), ("distance", limited)]
    head += [f"{title}: {' / '.join(names)}" for title, names in columns if names]
    rows = [
        (
            str(step["index"]),
            f"{step['frequency_Hz']:.6g}" if step["frequency_Hz"] else "",
            f"{step['target_amplitude']:.4g}",
            _percent(step["amplitude_error"], signed=True),
            f"{step['settle_s']:.3g}",
            "over 100" if (step["transient"] or 0.0) > 1.0 else _percent(step["transient"]),
            *(
                " / ".join(text)
                for names, text in (
                    (distorted, [_percent(step["distortion"].get(n)) for n in distorted]),
                    (ranged, [_percent(step["range_use"].get(n)) for n in ranged]),
                    (limited, [_distance(step["limit_use"].get(n)) for n in limited]),
                )
                if names
            ),
        )
        for step in steps
    ]
    return Table(caption=name, head=head, rows=rows, numbers=range(1, len(head)))


def _names(steps: Sequence[Row], field: str) -> list[str]:
    return list(dict.fromkeys(name for step in steps for name in step[field]))


def _percent(value: float | None, *, signed: bool = False) -> str:
    if value is None:
        return "-"
    return f"{100 * value:{'+' if signed else ''}.2g}"


def _distance(use: float | None) -> str:
    return "-" if use is None else f"{100 * (1 - use):.3g}"
