"""How the demonstration ends, for people: what was hidden, what was found, what that gains, where the files are."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.table import Table

from twin.commands.common.output import console, say


def tell_result(result: Mapping[str, Any], out: Path) -> None:
    """Print the ending of a demonstration whose results lie in `out`."""
    found = result["found"]
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    rows = {"hidden": _hidden(**result["hidden"]), "found": found["answer"]}
    if found["gain"]:
        rows["gain"] = _gain(found["gain"])
    rows |= {name: str(out / result["files"][name]) for name in ("report", "recording", "view")}
    for name, text in rows.items():
        table.add_row(name, text)
    console.print()
    console.print(table)
    stages = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in result["stages_s"].items())
    say(f"\n{result['seconds']:.0f} s in all ({stages}); the rest is in {out}")


def _hidden(cause: str, parameters: Mapping[str, float | str]) -> str:
    values = ", ".join(f"{k} {v}" if isinstance(v, str) else f"{k} {v:.4g}" for k, v in parameters.items())
    return f"{cause} ({values})" if values else cause


def _gain(gain: dict[str, Any]) -> str:
    before, after, noise_floor = (gain["held_out"][name] for name in ("before", "after", "noise_floor"))
    fold = before / max(after, 1e-12)
    told = f"{fold:.1f} times smaller" if fold > 1.05 else "as it was"
    what = " (fundamental and second harmonic)" if len(gain["by_harmonic"]) > 1 else ""
    return (
        f"error on the held-out sweep{what} {100 * before:.2g} % before, {100 * after:.2g} % after: {told} "
        f"(noise floor {100 * noise_floor:.2g} %)"
    )
