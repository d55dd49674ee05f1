"""Draw the README's pictures from the recordings of a demonstration; those of reports need Chromium.

twin demo --seed 7 --cause added-mass --out demo-pictures
python docs/make_pictures.py demo-pictures

Those of views need a graphics driver, in software too: Debian's mesa-vulkan-drivers.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from report_pictures import photograph
from view_pictures import draw_views

import twin
from twin.demo import BROADBAND, HELD_OUT, SWEEPS


def main(folder: Path, pictures: Path) -> None:
    """Diagnose what lies in `folder`, rehearse the shipped procedures, identify the rig from that, and draw it."""
    rig = twin.load_rig("steel-lap-joint")
    learn = [folder / name for name in (BROADBAND, SWEEPS)]
    found = rig.diagnose(learn, held_out=folder / HELD_OUT)
    rehearsed = [rig.rehearse(name, rounds=0) for name in ("steel-random", "steel-sweeps")]
    model = rig.identify([one.recording for one in rehearsed])
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
            "report-diagnosis": (
                found,
                f"twin diagnose {BROADBAND} {SWEEPS} --held-out {HELD_OUT} --rig steel-lap-joint",
            ),
            "report-identification": (model, "twin identify random/run.mcap sweeps/run.mcap --rig steel-lap-joint"),
            "report-rehearsal": (rehearsed[1], "twin rehearse steel-sweeps --rounds 0 --rig steel-lap-joint"),
        }
        pages = {Path(temporary) / f"{name}.html": pictures / f"{name}.png" for name in reports}
        for page, (result, command) in zip(pages, reports.values(), strict=True):
            result.report(page, commands=[f"{command} --out {page.stem}"])
        photograph(pages)
    draw_views(folder, pictures)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(__file__).parent / "pictures")
