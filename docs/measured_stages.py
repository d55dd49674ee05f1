"""What `docs/measure.py` runs, and how each command's answer becomes a table and, for some, a line of the README."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["STAGES", "Stage"]

Table = list[Sequence[str]]
"""Rows of cells, the first of them the headings."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One command and what is told of its answer.

    Attributes
    ----------
    title
        Its heading on the page.
    command
        The words after ``twin``, as a reader types them in a clone; what they write is thrown away.
    table
        From the answer (`--json`) to the page's table.
    figure
        What the README calls it; empty where the README does not tell it.  Such a command takes less than five minutes
        on two idle cores.
    line
        From the answer to the README's value.
    """

    title: str
    command: str
    table: Callable[[Any], Table]
    figure: str = ""
    line: Callable[[Any], str] = str


def _number(value: float | None, digits: int = 3) -> str:
    """To so many digits; thousands as people write them."""
    if value is None:
        return "-"
    told = f"{value:.{digits}g}"
    return f"{float(told):,.0f}" if 100 <= abs(value) < 1e6 else told


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{_number(100 * value, 2)} %"


def _span(values: Sequence[float]) -> str:
    return f"{min(values):.2g} to {max(values):.2g}"


def _parameters(values: dict[str, Any]) -> str:
    return ", ".join(
        f"{name} {value if isinstance(value, str) else _number(value, 4)}" for name, value in values.items()
    )


def _held_out(found: dict[str, Any]) -> str:
    if not found["gain"]:
        return "no gain"
    held = found["gain"]["held_out"]
    return f"{_percent(held['before'])} -> {_percent(held['after'])}, noise {_percent(held['noise_floor'])}"


def _diagnosis(found: dict[str, Any]) -> Table:
    return [
        ("verdict", "answer", "held-out error, before -> after", "s"),
        (found["verdict"], found["answer"], _held_out(found), f"{found['seconds']:.0f}"),
    ]


def _diagnosis_line(found: dict[str, Any]) -> str:
    return f"{found['answer']}  Held-out error {_held_out(found)}"


def _demo(answer: dict[str, Any]) -> Table:
    hidden = answer["hidden"]
    headings, row = _diagnosis(answer["found"])
    return [("hidden", *headings), (f"{hidden['cause']} ({_parameters(hidden['parameters'])})", *row)]


def _demo_line(answer: dict[str, Any]) -> str:
    return f"hidden: {_parameters(answer['hidden']['parameters'])}.  {_diagnosis_line(answer['found'])}"


def _study(answer: dict[str, Any]) -> Table:
    """Frequencies and, where there are any, sweeps of the one study in the answer."""
    (study,) = answer.values()
    table: Table = [("frequencies or sweep", "here, %", "the paper, %", "left out, %")]
    for condition, here in study["error_percent"]["this_model"].items():
        paper = study["error_percent"]["published_model"].get(condition, [])
        table.append(
            (f"natural frequencies, {condition}: worst error", _worst(here), _worst(paper) if paper else "-", "-")
        )
    for sweep, residual in study["residual_percent"].items():
        table.append(
            (
                f"sweep, {sweep}: residual", _number(residual["this_model"], 2), _number(residual.get("published"), 2),
                _number(residual.get("left_out_at_force"), 2),
            )
        )  # fmt: skip
    return table


def _worst(errors: Sequence[float]) -> str:
    return _number(max(map(abs, errors)))


def _frequencies_line(answer: dict[str, Any]) -> str:
    (study,) = answer.values()
    worst = {
        who: _worst([error for errors in study["error_percent"][who].values() for error in errors])
        for who in ("this_model", "published_model")
    }
    return f"worst {worst['this_model']} %, the paper {worst['published_model']} %; {study['free_parameters']} unknowns"


def _study_line(answer: dict[str, Any]) -> str:
    (study,) = answer.values()
    residuals = [one["this_model"] for one in study["residual_percent"].values()]
    return f"frequencies: {_frequencies_line(answer)}; sweeps: residual {_span(residuals)} %"


def _friction(answer: dict[str, Any]) -> Table:
    table: Table = [("loop", "law", "slip force, N", "R²", "R², law of the other loops")]
    for loop, force in answer["slip_force_N"].items():
        table.append(
            (
                loop, answer["law"], f"{force['value']:.0f} ± {force['std']:.0f}", _number(answer["r2"][loop], 4),
                _number(answer["left_out_r2"].get(loop), 4),
            )
        )  # fmt: skip
    return table


def _friction_line(answer: dict[str, Any]) -> str:
    forces = ", ".join(f"{force['value'] / 1e3:.2g}" for force in answer["slip_force_N"].values())
    return f"{answer['law']}; slip force {forces} kN; R² {min(answer['r2'].values()):.3f} or better"


def _rehearsal(answer: dict[str, Any]) -> Table:
    return [
        ("preload", "ended", "on the rig, h", "warnings"),
        *(
            (one["preload"], one["state"], f"{one['duration_s'] / 3600:.2f}", str(len(one["warnings"])))
            for one in answer["preloads"].values()
        ),
    ]


def _faults(answer: dict[str, Any]) -> Table:
    headings = ("fault", "tried", "noticed", "samples stored", "lost, and told", "silently wrong")
    keys = ("tried", "noticed", "stored", "lost", "silently_wrong")
    return [headings, *((row["fault"], *(f"{row[key]:,}" for key in keys)) for row in answer["faults"])]


def _faults_line(answer: dict[str, Any]) -> str:
    rows = [row for row in answer["faults"] if row["happened"]]
    noticed = sum(row["noticed"] for row in rows)
    return (
        f"{len(rows)} faults, {noticed} of {sum(row['tried'] for row in rows)} tries noticed; "
        f"samples silently wrong: {answer['silently_wrong']}"
    )


def _speed(answer: dict[str, Any]) -> Table:
    usual = ("ratio", "promise", "against", "error", "threads")
    table: Table = [("figure", "ratio", "to", "promised", "error", "more")]
    for name, row in answer.items():
        more = {key: value for key, value in row.items() if key not in usual}
        table.append(
            (name, _number(row["ratio"]), row["against"], _number(row["promise"]), _number(row["error"], 1),
             _parameters(more))
        )  # fmt: skip
    return table


def _speed_line(answer: dict[str, Any]) -> str:
    named = ("streaming", "gauss-newton-step", "gauss-newton-three-modes")
    return "; ".join(f"{_number(answer[name]['ratio'], 2)} times {answer[name]['against']}" for name in named)


def _campaign(answer: dict[str, Any]) -> Table:
    table: Table = [
        ("hidden", "size", "cases", "right", "otherwise", "a false cause beside", "in 95 % intervals",
         "error before / after", "s a diagnosis")
    ]  # fmt: skip
    for row in answer["rows"]:
        other = ", ".join(f"{count} {what}" for what, count in row["outcomes"].items() if what != "right")
        table.append(
            (
                row["label"], f"{row['strength']:g}", str(row["cases"]), str(row["outcomes"].get("right", 0)),
                other or "-", str(row["extra"]), f"{row['inside']} of {row['intervals']}", _number(row["gain"], 2),
                _number(row["diagnosis_s"], 2),
            )
        )  # fmt: skip
    return table


def _campaign_line(answer: dict[str, Any]) -> str:
    rows = answer["rows"]
    right, cases, inside, intervals, extra = (
        sum(counts)
        for counts in zip(
            *((r["outcomes"].get("right", 0), r["cases"], r["inside"], r["intervals"], r["extra"]) for r in rows),
            strict=True,
        )
    )
    line = f"{right} of {cases} right, a false cause in {extra}"
    return f"{line}; {inside} of {intervals} true parameters in their 95 % intervals" if intervals else line


def _of_campaigns(title: str, options: str, figure: str = "") -> Stage:
    return Stage(
        title=title, command=f"campaign --out campaign {options}", table=_campaign, figure=figure, line=_campaign_line
    )


STAGES: dict[str, Stage] = {
    "demo": Stage(
        title="The demonstration", command="demo --seed 7 --cause added-mass --out demo", table=_demo,
        figure="the whole chain: a hidden mass", line=_demo_line,
    ),
    "steel-lap-joint": Stage(
        title="The steel lap joint's paper", command="reproduce steel-lap-joint", table=_study,
        figure="steel lap joint", line=_study_line,
    ),
    "hybrid-joint": Stage(
        title="The hybrid joint's paper", command="reproduce hybrid-joint", table=_study,
        figure="hybrid joint", line=_study_line,
    ),
    "composite-beam": Stage(
        title="The composite beam's paper", command="reproduce composite-beam", table=_study,
        figure="composite beam, four frequencies, transverse shear", line=_frequencies_line,
    ),
    "brake-reuss": Stage(
        title="Brake-Reuss beam, measured sweeps",
        command="diagnose tests/data/brake-reuss/response_control.csv --rig brake-reuss --out brake-reuss",
        table=_diagnosis, figure="Brake-Reuss beam, measured sweeps", line=_diagnosis_line,
    ),
    "friction-damper": Stage(
        title="Friction damper, three clamp tensions, one law",
        command="friction " + " ".join(f"tests/data/friction-damper/{loop}lb.csv" for loop in (0, 30, 36)),
        table=_friction, figure="friction damper, measured at three clamp tensions", line=_friction_line,
    ),
    "clean-rigs": _of_campaigns(
        "Rigs with nothing hidden", "--cause none --seeds 2 --first-seed 2701", "rigs with nothing hidden, blind"
    ),
    "gain-and-slap": _of_campaigns(
        "A wrong gain, and a slapping joint, each hidden by itself",
        "--cause channel-gain --cause joint-slap --seeds 1 --first-seed 2605",
        "a wrong gain and a slapping joint, hidden blind",
    ),
    "faults": Stage(
        title="Faults of instruments and wires", command="faults --tries 2", table=_faults,
        figure="what instruments and wires do wrong", line=_faults_line,
    ),
    "speed": Stage(
        title="Speed", command="speed", table=_speed, figure="speed, side by side on one thread", line=_speed_line
    ),
    "rehearsal": Stage(
        title="The steel paper's campaign, rehearsed",
        command="rehearse steel-campaign --rig steel-lap-joint --preload 120N --preload 540N --rounds 0 --out DIR",
        table=_rehearsal,
    ),
    "every-cause": _of_campaigns("Every cause", "--seeds 1 --first-seed 2605"),
    "weak-causes": _of_campaigns("Every cause at a third of its size", "--seeds 1 --first-seed 2605 --strength 0.333"),
    "pairs": _of_campaigns("Two causes at once", "--seeds 1 --first-seed 2605 --pairs 30"),
    "two-modes": _of_campaigns("Every cause, sweeps about two resonances", "--modes 2 --seeds 1 --first-seed 3301"),
}  # fmt: skip
"""In the order of the page.  The last four take a quarter of an hour or more on two cores, the others minutes."""
