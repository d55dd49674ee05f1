"""The gallery: every shipped rig with its modes, a rehearsed sweep, and a diagnosis of a mass hidden on it.

python docs/make_gallery.py

writes ``docs/gallery.md`` and its pictures; with names behind it, only the sections of those rigs; with ``--modes`` the
rigs and their modes alone, in seconds instead of some minutes a rig.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

from matplotlib.figure import Figure

import twin
from recordings import read_run
from twin.campaign import CasePlan, record_case
from twin.demo import BROADBAND, SWEEPS, planned_sweeps, resonance
from twin.diagnose import diagnose
from twin.diagnose.answer.result import Diagnosis
from twin.rigs import RIG_FILES, load_rig
from twin.structure.modelled_rig import modelled_rig
from twin.views.reports.where import regions_of, where_figure
from twin.views.rig_figure import rig_figure

DOCS = Path(__file__).parent
PAGE, PICTURES = DOCS / "gallery.md", DOCS / "pictures" / "gallery"
SEED = 5
"""Of what is hidden and of everything else that an experimenter does not know."""
MODES = "--modes"
HEAD = """# Gallery

Every shipped rig as its file describes it, with its first modes, as `python docs/make_gallery.py --modes` draws them.
Without `--modes` each rig gets a rehearsed sweep as well, and what a diagnosis says of a mass hidden on it.
"""


def main(words: list[str]) -> None:
    """Make the sections of the named rigs, or of all, and keep the others'."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    text = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    sections = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    for name in [word for word in words if word != MODES] or list(RIG_FILES):
        print(f"making {name}", flush=True)
        sections[name] = _modes(name) + ("" if MODES in words else _measured(name))
        kept = "".join(f"\n## {rig}\n{sections[rig].rstrip()}\n" for rig in RIG_FILES if rig in sections)
        PAGE.write_text(HEAD + kept, encoding="utf-8")


def _modes(name: str) -> str:
    """Text of a rig and its modes; the picture is drawn on the way."""
    rig = load_rig(name)
    _save(rig_figure(modelled_rig(rig)), name)
    return f"""
{rig.sentence[:1].upper()}{rig.sentence[1:]}.

![{name} with its first modes](pictures/gallery/{name}.png)
"""


def _measured(name: str) -> str:
    """Text of a rehearsal and of a diagnosis, and their pictures."""
    rig, plan = load_rig(name), CasePlan(SEED, ("added-mass",))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        case, _ = record_case(plan, rig, folder)
        learnt = [read_run(folder / recording) for recording in plan.learnt]
        sweep = planned_sweeps(rig, resonance(read_run(folder / BROADBAND), rig))[SWEEPS]
        _save(twin.load_rig(name).rehearse(sweep, rounds=0).plot_responses(), f"{name}-rehearsed")
        found = diagnose(learnt, rig, held_out=[read_run(folder / recording) for recording in plan.held_out])
    (hidden,) = case.effects
    truth = ", ".join(f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}"
                      for key, value in hidden.parameters.items())  # fmt: skip
    return f"""
![Rehearsed sweeps](pictures/gallery/{name}-rehearsed.png)

Hidden: {hidden.cause}, {truth}.  The diagnosis, after {found.seconds:.0f} s: {found.sentence}
{_where(found, name)}"""


def _where(found: Diagnosis, name: str) -> str:
    regions = regions_of(found)
    if not regions:
        return ""
    _save(where_figure(found.evidence, regions, added=None), f"{name}-where")
    return f"\n![Where it is, with 95 %](pictures/gallery/{name}-where.png)\n"


def _save(figure: Figure, name: str) -> None:
    figure.savefig(PICTURES / f"{name}.png", dpi=60, facecolor="white")


if __name__ == "__main__":
    main(sys.argv[1:])
