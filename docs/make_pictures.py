"""Draw the README's pictures from the recordings of a demonstration; those of reports need Chromium.

twin demo --seed 7 --cause added-mass --out demo-pictures
python docs/make_pictures.py demo-pictures
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from report_pictures import photograph

import twin
from twin.demo import BROADBAND, HELD_OUT, SWEEPS


def main(folder: Path, pictures: Path) -> None:
    """Diagnose and identify what lies in `folder`, rehearse what could have been done, and draw it."""
    rig = twin.load_rig("steel-lap-joint")
    learn = [folder / name for name in (BROADBAND, SWEEPS)]
    found = rig.diagnose(learn, held_out=folder / HELD_OUT)
    model = rig.identify(learn)
    figures = {
        "sweeps": found.plot_sweeps(),
        "held-out": found.plot_held_out(),
        "broadband": found.plot_broadband(),
        "law": found.plot_law(),
    }
    pictures.mkdir(exist_ok=True)
    for name, figure in figures.items():
        figure.savefig(pictures / f"{name}.png", dpi=90, facecolor="white")
    with tempfile.TemporaryDirectory() as temporary:
        reports = {
            "report-diagnosis": (found, f"twin diagnose {BROADBAND} {SWEEPS} --held-out {HELD_OUT}"),
            "report-identification": (model, f"twin identify {BROADBAND} {SWEEPS}"),
            "report-rehearsal": (rig.rehearse("steel-sweeps", rounds=0), "twin rehearse steel-sweeps --rounds 0"),
        }
        pages = {Path(temporary) / f"{name}.html": pictures / f"{name}.png" for name in reports}
        for page, (result, command) in zip(pages, reports.values(), strict=True):
            result.report(page, commands=[f"{command} --rig steel-lap-joint --out {page.stem}"])
        photograph(pages)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(__file__).parent / "pictures")
