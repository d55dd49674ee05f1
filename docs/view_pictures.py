"""Draw the guides' pictures of the views in rerun, live and recorded, by a viewer without a screen.

twin demo --seed 7 --cause added-mass --out demo-pictures
python docs/view_pictures.py demo-pictures

A graphics driver is needed, in software too: Debian's mesa-vulkan-drivers.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from twin.bench import open_bench
from twin.commands.common.viewing import Watch, known_branches
from twin.procedures import StepResult, load_procedure
from twin.rehearsal import NominalRig, rehearse
from twin.rigs import load_rig
from twin.views.live.about import LiveAbout
from twin.views.live.view import LiveView
from twin.views.rerun.motion import SLOW_MOTION
from twin.views.rerun.viewer import headless_viewer, save_picture

LIVE_STEP = 105
"""Of 123: the picture of the live view is taken when so many are measured, in the middle of the last sweep."""


def draw_views(folder: Path, pictures: Path) -> None:
    """Pictures of the view that a demonstration left in `folder`, and of a rehearsal as it runs."""
    pictures.mkdir(exist_ok=True)
    with headless_viewer(file=folder / "run.rrd") as viewer:
        save_picture(viewer, pictures / "view-diagnosis.png", at=(SLOW_MOTION, 0.4))
    with tempfile.TemporaryDirectory() as temporary:
        _draw_live(Path(temporary) / "run.mcap", pictures / "view-live.png")


def _draw_live(recording: Path, picture: Path) -> None:
    rig, procedure = load_rig("steel-lap-joint"), load_procedure("steel-sweeps")
    source = open_bench(rig, sample_rate_Hz=procedure.sample_rate)
    about = LiveAbout(
        title="steel-lap-joint · steel-sweeps, rehearsed",
        channels=tuple(source.channels),
        procedure=procedure,
        branches=tuple(known_branches(rig, None, procedure)),
        window_s=60.0,
    )
    with headless_viewer() as viewer:
        view = LiveView(about, viewer.url)
        watch = Watch([view])
        measured: list[StepResult] = []

        def on_step(step: StepResult) -> None:
            measured.append(step)
            watch.show(step)
            if len(measured) == LIVE_STEP:
                save_picture(viewer, picture)

        rehearse(procedure, source, recording, nominal=NominalRig(), on_step=on_step, watch=watch.both)
        view.close()


if __name__ == "__main__":
    draw_views(Path(sys.argv[1]), Path(__file__).parent / "pictures")
