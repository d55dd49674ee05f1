"""The table of causes in ``docs/causes.md``, from the causes themselves: ``python docs/make_causes.py``."""

from __future__ import annotations

import inspect
from pathlib import Path

from twin.bench.effects import EFFECTS
from twin.cause_registry.registry import NAMES
from twin.diagnose.models import CAUSES

PAGE = Path(__file__).parent / "causes.md"
PLACE = ("position_m", "part", "node", "direction")
"""What tells a place; one word in the table."""

HEAD = """# Causes and their parameters

What a diagnosis may name and what a rig file's `[[effect]]` may hide, as `cause` and `parameters`.  All numbers are SI;
a unit is the end of a parameter's name.  A place is `position_m` along the structure or along a `part`, or a `part` and
a `node` of it, and for a push its `direction`.  Parameters in brackets may be left out; so may `joint` and `support`
where there is only one.

| cause | parameters | what it is |
| --- | --- | --- |
"""


def table() -> str:
    """The page."""
    rows = []
    for name in NAMES:
        own = (inspect.getdoc(EFFECTS[name]) or "").partition("\n")[0].rstrip(".")
        summary = CAUSES[name].summary if name in CAUSES else own
        rows.append(f"| `{name}` | {', '.join(_parameters(name))} | {summary[:1].lower()}{summary[1:]} |")
    return HEAD + "\n".join(rows) + "\n"


def _parameters(name: str) -> list[str]:
    asked = list(inspect.signature(EFFECTS[name]).parameters.items())[1:]
    place = ["place"] if any(key in (*PLACE, "place") for key, _ in asked) else []
    return place + [
        f"`{key}`" if parameter.default is inspect.Parameter.empty else f"[`{key}`]"
        for key, parameter in asked if key not in (*PLACE, "place")
    ]  # fmt: skip


if __name__ == "__main__":
    PAGE.write_text(table(), encoding="utf-8")
