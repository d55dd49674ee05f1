"""rerun's own viewer, without a screen, draws what was saved and what comes live."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from needed import needs
from recorded_views import CHANNELS, FREQUENCIES_Hz, RATE_Hz, sdof_receptance

from twin.diagnose.answer.result import Diagnosis
from twin.procedures import SteppedSine, StepResult
from twin.views.live.about import LiveAbout
from twin.views.live.view import LiveView
from twin.views.rerun.diagnosis import save_diagnosis
from twin.views.rerun.motion import SLOW_MOTION
from twin.views.rerun.viewer import headless_viewer, save_picture

pytestmark = [
    pytest.mark.slow,
    needs("a Vulkan driver"),
]


def right_part(png: Path) -> Any:
    """Red, green and blue of the charts, right of the text."""
    pixels = matplotlib.image.imread(png)[:, :, :3]
    assert pixels.shape[:2] == (1080, 1920)
    return np.moveaxis(pixels[:, pixels.shape[1] // 3 :], -1, 0)


def test_the_viewer_shows_curves_of_every_kind(diagnosis: Diagnosis, tmp_path: Path) -> None:
    save_diagnosis(diagnosis, tmp_path / "view.rrd")
    with headless_viewer(file=tmp_path / "view.rrd") as viewer:
        save_picture(viewer, tmp_path / "view.png", at=(SLOW_MOTION, 0.5))
    assert viewer.process.poll() is not None
    red, green, blue = right_part(tmp_path / "view.png")
    assert (blue - red > 0.35).sum() > 500, "the first level"
    assert (red - blue > 0.35).sum() > 500, "the second level"
    assert np.max([red, green, blue]) > 0.8
    assert green.mean() < 0.3, "a dark ground"


def test_the_viewer_shows_a_sweep_as_it_grows(tmp_path: Path) -> None:
    procedure = SteppedSine(frequencies=list(FREQUENCIES_Hz), amplitudes=[2.0], sample_rate=RATE_Hz)
    picture = tmp_path / "live.png"
    with headless_viewer() as viewer:
        view = LiveView(LiveAbout(title="one resonance", channels=CHANNELS, procedure=procedure), viewer.url)
        blue = []
        for index, frequency in enumerate(FREQUENCIES_Hz):
            acceleration = (2 * np.pi * frequency) ** 2 * sdof_receptance(frequency) * 2.0
            view.show(
                StepResult(
                    sweep="2N-up", index=index, frequency_Hz=frequency, target_channel="force", target_amplitude=2.0,
                    voltage_V=1.0, amplitude=2.0, settle_s=0.5, measure_s=0.5,
                    phasors={"force": 2.0 + 0j, "acc1": acceleration},
                ),
                (index + 1) * 10**9,
            )  # fmt: skip
            if index in (0, len(FREQUENCIES_Hz) - 1):
                save_picture(viewer, picture)
                pixels = right_part(picture)
                blue.append(int((pixels[2] - pixels[0] > 0.35).sum()))
        assert view.close()
    assert blue[-1] > blue[0] + 200
