"""The page and the picture of ``twin speed --scaling``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.memory import PROMISED_MB, LENGTHS_s

PICTURE = Path("pictures") / "scaling.png"
HEAD = """# Cost against size

`twin speed --scaling --page docs/speed.md` measured this on one thread of one machine: processor time, both sides in
turns in the same run and as often, the shortest try of each.  Seconds are this machine's; ratios and exponents carry
over.  The error is the largest difference of the two answers to the very problem that was timed, over the largest
answer; for stability it is what a step four times shorter changes of the largest multiplier.

![Cost against size](pictures/scaling.png)
"""


def write_page(page: Path, works: Mapping[str, dict[str, Any]], memory: Sequence[dict[str, Any]]) -> None:
    """Write both, the picture in a folder beside the page."""
    lines = [HEAD]
    for name, work in works.items():
        lines += _section(name, work)
    lines += [
        "## memory", "", f"Four channels at 25.6 kHz.  Asked: {PROMISED_MB:g} MB for an hour.", "",
        f"| stage | MB for {LENGTHS_s[0]} s | for {LENGTHS_s[1]} s | that is, for an hour | |",
        "| --- | ---: | ---: | ---: | --- |",
        *(
            f"| {m['stage']} | {m['shorter_MB']:.0f} | {m['longer_MB']:.0f} | {m['hour_MB']:.0f} | "
            f"{'held' if m['held'] else 'not held'} |"
            for m in memory
        ),
    ]  # fmt: skip
    picture = page.parent / PICTURE
    picture.parent.mkdir(parents=True, exist_ok=True)
    _draw(picture, works)
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _section(name: str, work: Mapping[str, Any]) -> list[str]:
    """One work's table under its heading."""
    exponents = f"exponent {work['exponent']:.1f}, of the other {work['exponent_of_the_other']:.1f}"
    asked = f"Asked: {work['limit']} - {'held' if work['held'] else 'not held'}."
    rows = [(c["size"], 1e6 * c["ours_s"], 1e6 * c["other_s"], c["ratio"], c["error"]) for c in work["costs"]]
    return [
        f"## {name}", "", f"Against {work['against']}; {exponents}.  {asked}", "",
        f"| {work['sized']} | us a {work['per']} | of the other | ratio | error |",
        "| ---: | ---: | ---: | ---: | ---: |",
        *("| {} | {:.3g} | {:.3g} | {:.2g} | {:.1g} |".format(*row) for row in rows),
        "",
    ]  # fmt: skip


def _draw(path: Path, works: Mapping[str, dict[str, Any]]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    for axes, (name, work) in zip(figure.subplots(2, 3).ravel(), works.items(), strict=False):
        sizes = [c["size"] for c in work["costs"]]
        for key, label, style in (("ours_s", "exponent", "o-"), ("other_s", "exponent_of_the_other", "s--")):
            legend = f"{'this' if key == 'ours_s' else 'the other'}, exponent {work[label]:.1f}"
            axes.loglog(sizes, [c[key] for c in work["costs"]], style, label=legend)
        axes.set(title=name, xlabel=work["sized"], ylabel=f"s a {work['per']}")
        axes.minorticks_off()
        axes.set_xticks(sizes, [str(size) for size in sizes])
        axes.legend(fontsize="small")
    figure.savefig(path, dpi=100)
