"""rerun's own viewer, without a screen, draws what was saved."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest
from recorded_views import rerun_program

from twin.diagnose.result import Diagnosis
from twin.views import save_diagnosis

SCRIPT = """
import sys, time
from rerun.experimental import ViewerClient
viewer = ViewerClient.spawn(headless=True, port=int(sys.argv[3]), hide_welcome_screen=True, executable_path=sys.argv[4])
try:
    viewer.open(sys.argv[1])
    time.sleep(3)
    viewer.save_screenshot(sys.argv[2])
finally:
    viewer.quit()
"""


@pytest.mark.slow
@pytest.mark.skipif(
    not list(Path("/usr/share/vulkan/icd.d").glob("*.json")), reason="no Vulkan driver: Debian's mesa-vulkan-drivers"
)
def test_the_viewer_shows_curves_of_every_kind(diagnosis: Diagnosis, tmp_path: Path) -> None:
    save_diagnosis(diagnosis, tmp_path / "view.rrd")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    png = tmp_path / "view.png"
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "view.rrd"), str(png), str(port), rerun_program()],
        capture_output=True, text=True, timeout=90, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pixels = matplotlib.image.imread(png)[:, :, :3]
    right = pixels[:, pixels.shape[1] // 3 :]
    red, green, blue = right[:, :, 0], right[:, :, 1], right[:, :, 2]
    assert (blue - red > 0.35).sum() > 500, "the first level"
    assert (red - blue > 0.35).sum() > 500, "the second level"
    assert right.max() > 0.8
    assert green.mean() < 0.3, "a dark ground"
