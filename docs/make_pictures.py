"""Draw the README's pictures from the recordings of a demonstration.

twin demo --seed 7 --cause added-mass --out demo-pictures
python docs/make_pictures.py demo-pictures
"""

from __future__ import annotations

import sys
from pathlib import Path

from recordings import read_run
from twin.demo import BROADBAND, HELD_OUT, SWEEPS
from twin.diagnose import diagnose
from twin.rigs import load_rig
from twin.views.figures import broadband_figure, law_figure, sweeps_figure


def main(folder: Path, pictures: Path) -> None:
    """Diagnose what lies in `folder`, and draw it."""
    learn = [read_run(folder / name) for name in (BROADBAND, SWEEPS)]
    found = diagnose(learn, load_rig("steel-lap-joint"), held_out=[read_run(folder / HELD_OUT)])
    models = {"before": found.search.base, "after": found.search.model}
    figures = {
        "sweeps": sweeps_figure(found.evidence, found.sweeps),
        "held-out": sweeps_figure(found.evidence, found.held_out),
        "broadband": broadband_figure(found.evidence, models),
        "law": law_figure(found.evidence, models),
    }
    pictures.mkdir(exist_ok=True)
    for name, figure in figures.items():
        if figure is not None:
            figure.savefig(pictures / f"{name}.png", dpi=90, facecolor="white")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(__file__).parent / "pictures")
