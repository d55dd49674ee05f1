"""The report of a rehearsal, from its table (``result.json``): may the procedure be run, and what to know before."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from twin.identify.estimate import Estimate
from twin.views.page import LEFT_OUT, Page, Picture, Section, Table
from twin.views.reports.rehearsal_figures import Rows, noise_figure, range_figure, responses_figures
from twin.views.style import AFTER, BEFORE, CAUTION


def rehearsal_sentence(result: Mapping[str, Any]) -> str:
    """The answer in one sentence."""
    count = Counter(warning["severity"] for warning in result["warnings"])
    took = f"{len(result['steps'])} steps in {result['duration_s'] / 60:.1f} min of the rig's time"
    if result["must_not_run"]:
        why = next((w["reason"] for w in result["warnings"] if w["severity"] == "stop"), result["reason"])
        return f"The procedure must not be run like this: {why}{_improvement(result)}."
    if result["state"] != "done":
        return f"The rehearsal was {result['state']}: {result['reason']}."
    if count["warning"]:
        plural = "warning says" if count["warning"] == 1 else "warnings say"
        mislead = f"The procedure gets to its end, {took}, but {count['warning']} {plural} that its data would mislead"
        return mislead + _improvement(result) + "."
    return f"The procedure can be run as it is: {took}, no warnings{counted_notes(count['note'])}."


def counted_notes(count: int) -> str:
    """What stands beside no warnings, as the end of a sentence."""
    return f" but {count} note{'s' if count > 1 else ''} on what to expect" if count else ""


def _improvement(result: Mapping[str, Any]) -> str:
    """What is left of the warnings where the procedure was improved, as the end of a sentence."""
    better = result.get("improved")
    if not better:
        return ""
    if better["cleared"]:
        return "; the improved procedure raises none"
    left = " and ".join(better["remaining"]) or better["reason"]
    return f"; the improved procedure does not clear them all: {left} remains"


def rehearsal_page(result: Mapping[str, Any]) -> Page:
    """The report of a rehearsal, from what ``twin rehearse`` writes as ``result.json``."""
    preload = f", preload {result['preload']}" if result.get("preload") else ""
    page = Page(
        title="Rehearsal of a vibration test",
        answer=rehearsal_sentence(result),
        facts=f"Procedure {result.get('procedure', '')} on rig {result.get('rig', '')}{preload}.",
        sections=[section for section in _sections(result) if section is not None],
        accent=BEFORE if result["must_not_run"] else AFTER if result["clear"] else CAUTION,
    )
    return page.beginning(LEFT_OUT, result.get("assumed") or [])


def _sections(result: Mapping[str, Any]) -> Iterator[Section | None]:
    yield _warnings(result, "Warnings and notes")
    yield _sweeps(result)
    yield from map(noise_section, result.get("noise") or [])
    yield _decays(result)
    yield _resources(result)
    if result.get("improved"):
        yield _improved(result["improved"], result.get("branches") or [])
        yield from map(noise_section, result["improved"].get("noise") or [])
    yield Section(
        title="What was assumed",
        items=[
            "The rig behaves as its file says, and where that says nothing as is told above.",
            "Predicted branches are harmonic balance without shaker, noise or converter; at a fold a sweep jumps.",
        ],
    )
    yield Section(
        title="What is uncertain",
        items=[
            "Where the resonances lie and how sharp they are is assumed, not measured: a real joint that is softer or "
            "better damped moves peaks, settling times and jumps by as much.",
            "At a fold a sweep jumps within a step of where it is predicted, as the transient of the last step has it.",
            "The noise is one draw; a warning that hangs on it alone may come or go with another seed.",
        ],
    )
    yield _steps(result["steps"], "Every step")
    if result.get("improved"):
        yield _steps(result["improved"]["steps"], "Every step of the improved procedure")


def warnings_table(result: Mapping[str, Any]) -> Table:
    """What would mislead, and how to change it."""
    rows = [
        (
            w["kind"], w["severity"],
            (f"{w['sweep']}, step {w['index']}" if w["sweep"] else "")
            + (f", {w['frequency_Hz']:g} Hz" if w["frequency_Hz"] else ""),
            str(w["steps"]), w["reason"], w["advice"],
        )
        for w in result["warnings"]
    ]  # fmt: skip
    head = ("kind", "severity", "worst step", "steps", "what is wrong", "what to change")
    return Table(caption="Warnings and notes, gravest first", head=head, rows=rows, numbers=(3,))


def _warnings(result: Mapping[str, Any], title: str) -> Section:
    table = warnings_table(result)
    return Section(title=title, tables=[table]) if table.rows else Section(title=title, texts=["None."])


def sweeps_table(result: Mapping[str, Any]) -> Table:
    """How long each sweep takes, and the largest response in it."""
    rows = [
        (
            s["sweep"], str(s["steps"]), f"{s['duration_s']:.0f}", f"{s['peak_frequency_Hz']:.6g}",
            f"{s['peak_response']:.4g}", s["response_channel"],
            "" if s["quality_factor"] is None or math.isnan(s["quality_factor"]) else f"{s['quality_factor']:.0f}",
        )
        for s in result["sweeps"]
    ]  # fmt: skip
    head = ("sweep", "steps", "time, s", "peak at, Hz", "peak, SI units", "channel", "Q")
    return Table(caption="Each sweep at a glance", head=head, rows=rows, numbers=(1, 2, 3, 4, 6))


def _sweeps(result: Mapping[str, Any]) -> Section | None:
    if not result["sweeps"]:
        return None
    return Section(
        title="Sweeps",
        tables=[sweeps_table(result)],
        pictures=_responses(result["steps"], result["sweeps"], result.get("branches") or []),
    )


def _responses(steps: Rows, sweeps: Rows, branches: Rows) -> list[Picture]:
    seen = dict.fromkeys(name for step in steps for name in step["phasors"])
    force = next((name for name in seen if name == "force" or name.startswith("force")), None)
    channels = [name for name in seen if name not in (force, "voltage", "current")][:4]
    over = ", over the predicted branches" if branches else ""
    pictures = []
    for figure, about in responses_figures(steps, branches, channels, force):
        low, high = (end(step["frequency_Hz"] for step in about) for end in (min, max))
        tops = [sweep for sweep in sweeps if low <= sweep["peak_frequency_Hz"] <= high]
        peaks = "; ".join(f"{sweep['sweep']} peaks at {sweep['peak_frequency_Hz']:.6g} Hz" for sweep in tops)
        pictures.append(
            Picture(
                draw=lambda figure=figure: figure,  # type: ignore[misc]
                alt=f"Response per force at every step from {low:g} to {high:g} Hz{over}. {peaks}.",
                caption="Every step (points)"
                + (", over the branches of harmonic balance (lines)." if branches else "."),
            )
        )
    return pictures


def _decays(result: Mapping[str, Any]) -> Section | None:
    """Damping ratio and frequency of each ring-down, and of its parts where they differ."""
    rows = []
    for decay in result.get("decays") or []:
        place = f"{decay['sweep']}, step {decay['index']}"
        whole = ("whole", decay["amplitude"], decay["frequency_Hz"], f"{100 * decay['damping_ratio']:.4g}")
        parts = [
            (f"part {i}", part["amplitude"], part["frequency_Hz"],
             str(Estimate(part["damping_ratio"], part["damping_ratio_std"]).scaled(100)))
            for i, part in enumerate(decay["parts"] if decay["depends"] else [], 1)
        ]  # fmt: skip
        rows += [
            (place, decay["channel"], name, f"{amplitude:.4g}", f"{frequency:.6g}", ratio)
            for name, amplitude, frequency, ratio in (whole, *parts)
        ]
    if not rows:
        return None
    head = ("decay", "channel", "of it", "amplitude, SI units", "frequency, Hz", "damping ratio, %")
    depends = any(decay["depends"] for decay in result["decays"])
    told = "changes with the amplitude" if depends else "does not change with the amplitude by more than 2 %"
    return Section(
        title="Decays",
        texts=[
            f"The damping ratio {told}. It is that of the rig with its shaker attached, the generator at zero: the "
            "logarithmic decrement of the amplitude, followed down to ten times the noise."
        ],
        tables=[Table(caption="Each decay", head=head, rows=rows, numbers=(3, 4, 5))],
    )


def _resources(result: Mapping[str, Any]) -> Section | None:
    figure = range_figure(result["steps"])
    if figure is None:
        return None
    most: dict[str, float] = {}
    for step in result["steps"]:
        for name, use in step["range_use"].items():
            most[name] = max(most.get(name, 0.0), use)
    told = "; ".join(f"{name} {100 * use:.3g} %" for name, use in most.items())
    return Section(
        title="Range and time",
        texts=[f"Largest use of the converter's range: {told}."],
        pictures=[
            Picture(
                draw=lambda: figure,
                alt=f"Use of each converter's range by step on a logarithmic scale, at most {told}; time of each step.",
                caption="Peak of each channel as a part of its converter's range, and the time that each step takes.",
            )
        ],
    )


def _improved(better: Mapping[str, Any], branches: Rows) -> Section:
    took = f"{len(better['steps'])} steps in {better['duration_s'] / 60:.1f} min of the rig's time."
    warned = _warnings(better, "The improved procedure")
    tables = [*warned.tables, *([sweeps_table(better)] if better["sweeps"] else [])]
    left = [] if better["cleared"] or not better["remaining"] else [f"Not cleared: {', '.join(better['remaining'])}."]
    return Section(
        title=warned.title,
        texts=[took, *left, *(f"Warnings: {text}" for text in warned.texts)],
        tables=tables,
        pictures=_responses(better["steps"], better["sweeps"], branches),
    )


def noise_sentence(noise: Mapping[str, Any]) -> str:
    """What a stretch of noise shows, and whether it was long enough."""
    modes = ", ".join(f"{mode['frequency_Hz']:.4g}" for mode in noise["modes"])
    told = f"{noise['sweep']}: modes found at {modes} Hz" if modes else f"{noise['sweep']}: no mode found"
    coherence = [value for values in noise["coherence"].values() for value in values]
    told += f"; median coherence {np.median(coherence):.3g}" if coherence else ""
    lowest = noise["lowest_mode"]
    if lowest is None:
        return told
    return (
        f"{told}; {noise['duration_s']:.4g} s make {lowest['averages']:.2g} averages at the width of the lowest mode, "
        f"{lowest['width_Hz']:.2g} Hz at {lowest['frequency_Hz']:.4g} Hz"
    )


def noise_section(noise: Mapping[str, Any]) -> Section:
    """A stretch of noise at a glance."""
    rows = [
        (
            str(number), f"{mode['frequency_Hz']:.6g}", f"{mode['frequency_std_Hz']:.1g}",
            f"{100 * mode['damping_ratio']:.4g}", f"{100 * mode['damping_std']:.1g}",
        )
        for number, mode in enumerate(noise["modes"], 1)
    ]  # fmt: skip
    head = ("mode", "frequency, Hz", "std", "damping ratio, %", "std")
    told = noise_sentence(noise)
    return Section(
        title="Noise",
        texts=[f"{told}."],
        tables=[Table(caption="Modes that it shows", head=head, rows=rows, numbers=range(5))] if rows else [],
        pictures=[
            Picture(
                draw=lambda: noise_figure(noise),
                alt=f"Spectral densities of all channels, responses per force and coherence over frequency. {told}.",
                caption=f"Densities, responses per force and coherence at a resolution of {noise['resolution_Hz']:.2g} "
                "Hz, averaged over stretches, each of which begins in the middle of the one before.",
            )
        ],
    )


def _steps(steps: Rows, title: str) -> Section | None:
    """All steps of a rehearsal's table (``result.json``); None without any."""
    sweeps: dict[str, list[Mapping[str, Any]]] = {}
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
        tables=[_sweep_steps(name, rows) for name, rows in sweeps.items()],
    )


def _sweep_steps(name: str, steps: Rows) -> Table:
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


def _names(steps: Rows, field: str) -> list[str]:
    return list(dict.fromkeys(name for step in steps for name in step[field]))


def _percent(value: float | None, *, signed: bool = False) -> str:
    if value is None:
        return "-"
    return f"{100 * value:{'+' if signed else ''}.2g}"


def _distance(use: float | None) -> str:
    return "-" if use is None else f"{100 * (1 - use):.3g}"
