"""Draw the pictures of the README and the guides from a demonstration's recordings; those of reports need Chromium.

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
    """Diagnose what lies in `folder`, rehearse a shipped procedure, and draw both."""
    rig = twin.load_rig("steel-lap-joint")
    learn = [folder / name for name in (BROADBAND, SWEEPS)]
    found = rig.diagnose(learn, held_out=folder / HELD_OUT)
    pictures.mkdir(exist_ok=True)
    found.plot_sweeps().savefig(pictures / "sweeps.png", dpi=90, facecolor="white")
    with tempfile.TemporaryDirectory() as temporary:
        reports = {
            "report-diagnosis": (
                found,
                f"twin diagnose {BROADBAND} {SWEEPS} --held-out {HELD_OUT} --rig steel-lap-joint",
            ),
            "report-rehearsal": (
                rig.rehearse("steel-sweeps", rounds=0),
                "twin rehearse steel-sweeps --rounds 0 --rig steel-lap-joint",
            ),
        }
        pages = {Path(temporary) / f"{name}.html": pictures / f"{name}.png" for name in reports}
        for page, (result, command) in zip(pages, reports.values(), strict=True):
            result.report(page, commands=[f"{command} --out {page.stem}"])
        photograph(pages)
    draw_views(folder, pictures)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(__file__).parent / "pictures")
