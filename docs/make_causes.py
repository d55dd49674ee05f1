"""The pages of causes: the table ``docs/causes.md`` and a page a cause, ``python docs/make_causes.py``.

What a page says of a cause is in the cause's own folder; its case is made by ``python docs/cause_cases.py``.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from cause_cases import kept

from twin.bench.effects import EFFECTS
from twin.cause_registry import advice_on
from twin.cause_registry.registry import NAMES
from twin.diagnose.models import CAUSES

DOCS = Path(__file__).parent
PAGE = DOCS / "causes.md"
PLACE = ("position_m", "part", "node", "direction")
"""What tells a place; one word in the table."""
MOST = 6
"""Rows of a table of rivals."""

HEAD = """# Causes and their parameters

What a diagnosis may name and what a rig file's `[[effect]]` may hide, as `cause` and `parameters`.  All numbers are SI;
a unit is the end of a parameter's name.  A place is `position_m` along the structure or along a `part`, or a `part` and
a `node` of it, and for a push its `direction`.  Parameters in brackets may be left out; so may `joint` and `support`
where there is only one.  The page of each shows a case: what it looks like, what else does, and what to do on the rig.

| cause | parameters | what it is |
| --- | --- | --- |
"""


def table() -> str:
    """The page with all of them."""
    rows = (f"| [`{name}`](causes/{name}.md) | {', '.join(_parameters(name))} | {_summary(name)} |\n" for name in NAMES)
    return HEAD + "".join(rows)


def page(cause: str, case: Mapping[str, Any]) -> str:
    """The page of one cause.

    Parameters
    ----------
    case
        What ``docs/cause_cases.py`` keeps of it.
    """
    return "\n".join(_lines(cause, case)) + "\n"


def _lines(cause: str, case: Mapping[str, Any]) -> Iterator[str]:
    advice = advice_on(cause)
    assert advice is not None
    summary = _summary(cause)
    yield from (f"# {cause}", "", f"{summary[0].upper()}{summary[1:]}.  [All causes](../causes.md).", "")
    yield from ("## What it looks like", "", advice.looks_like, "")
    yield from (f"![Recordings with {cause} and without it]({cause}.png)", "")
    yield from ("Hidden in the steel lap joint, as its rig file would say it:", "", "```toml", "[[effect]]")
    hidden = ", ".join(f"{name} = {json.dumps(value)}" for name, value in case["hidden"].items())
    yield from (f'cause = "{cause}"', f"parameters = {{ {hidden} }}" if hidden else "parameters = {}", "```", "")
    if "scored" in case:
        yield from ("## What else looks like it", "")
        yield from _rivals(case)
    yield from ("## How to tell them apart", "", advice.tell_apart, "", "## What to do on the rig", "")
    yield from (advice.on_the_rig, "")
    if "answer" in case:
        fall = f"before {case['before']:.3g}, after {case['after']:.3g}"
        yield from ("## What the diagnosis says of this case", "", f"> {case['answer']}", "")
        yield from (f"Verdict `{case['verdict']}`; chi² per degree of freedom {fall}.", "")
    yield f"Version {case['version']}; `python docs/cause_cases.py {cause}` makes the case again."


def _rivals(case: Mapping[str, Any]) -> Iterator[str]:
    """What the score test suspects, and what is left of it once models are fitted."""
    scored = list(case["scored"].items())[:MOST]
    if not scored:
        yield from ("Nothing that moves: the samples show it by themselves, and no model is asked.", "")
        return
    yield from ("To first order, before a model is fitted, these would explain some of it:", "")
    yield from ("| cause | expected gain of log evidence |", "| --- | ---: |")
    yield from (f"| [`{name}`]({name}.md) | {gain:+.4g} |" for name, gain in scored)
    if case["fitted"]:
        yield from ("", "Fitted together with moduli, damping and the joint's law:", "")
        yield from ("| model with | gain of log evidence |", "| --- | ---: |")
        rows = ((", ".join(model["causes"]), model["gain"]) for model in case["fitted"][:MOST])
        yield from (f"| {names} | {gain:+.4g} |" for names, gain in rows)
    yield ""


def _summary(name: str) -> str:
    own = (inspect.getdoc(EFFECTS[name]) or "").partition("\n")[0].rstrip(".")
    summary = CAUSES[name].summary if name in CAUSES else own
    return f"{summary[:1].lower()}{summary[1:]}"


def _parameters(name: str) -> list[str]:
    asked = list(inspect.signature(EFFECTS[name]).parameters.items())[1:]
    place = ["place"] if any(key in (*PLACE, "place") for key, _ in asked) else []
    return place + [
        f"`{key}`" if parameter.default is inspect.Parameter.empty else f"[`{key}`]"
        for key, parameter in asked if key not in (*PLACE, "place")
    ]  # fmt: skip


if __name__ == "__main__":
    PAGE.write_text(table(), encoding="utf-8")
    for cause in NAMES:
        (DOCS / "causes" / f"{cause}.md").write_text(page(cause, kept(cause)), encoding="utf-8")
