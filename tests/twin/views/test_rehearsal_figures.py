"""Pictures of a rehearsal: what they are to show can be seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from twin.views.reports.rehearsal_figures import range_figure, responses_figure, responses_figures


def _pixels(figure: Figure) -> np.ndarray:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3]


def _sweep(rehearsal: dict[str, Any], name: str, amplitude: float) -> list[dict[str, Any]]:
    return [{**step, "sweep": name, "target_amplitude": amplitude} for step in rehearsal["steps"]]


def test_the_legend_of_six_sweeps_lies_within_the_picture(rehearsal: dict[str, Any]) -> None:
    steps = [s for a in (1.5, 3.0, 6.0) for way in ("up", "down") for s in _sweep(rehearsal, f"{a:g}N-{way}", a)]
    branch = {
        "force_N": 6.0, "frequency_Hz": [25.0, 28.0], "stable": [True, False],
        "response": {"acc1": {"amplitude": [1.0, 2.0]}},
    }  # fmt: skip
    figure = responses_figure(steps, [branch], ["acc1"], "force")
    assert figure is not None
    _pixels(figure)
    box, frame = figure.legends[0].get_window_extent(), figure.bbox
    assert len(figure.legends[0].get_texts()) == 8
    assert frame.x0 <= box.x0 < box.x1 <= frame.x1
    assert frame.y0 <= box.y0 < box.y1 <= frame.y1


def test_each_resonance_has_its_own_picture(rehearsal: dict[str, Any]) -> None:
    """With the branches that lie there."""
    low = _sweep(rehearsal, "2N-up", 2.0)
    high = [{**step, "frequency_Hz": 6 * step["frequency_Hz"]} for step in low if step["frequency_Hz"]]
    places = [[25.0, 26.0], [150.0, 156.0]]
    branches = [{"force_N": 2.0, "frequency_Hz": f, "response": {"acc1": {"amplitude": [1.0, 2.0]}}} for f in places]
    found = responses_figures([*high, *low], branches, ["acc1"], "force")
    assert [len(about) for _, about in found] == [len([s for s in low if s["frequency_Hz"]]), len(high)]
    for (figure, about), (first, last) in zip(found, places, strict=True):
        drawn = np.concatenate([line.get_xdata() for line in figure.axes[0].lines])
        assert {first, last} <= set(drawn.tolist())
        assert drawn.max() < 1.5 * min(step["frequency_Hz"] for step in about)


def test_a_single_measured_step_is_seen(rehearsal: dict[str, Any]) -> None:
    steps = [{**rehearsal["steps"][0]}, {**rehearsal["steps"][1], "range_use": {}}]
    figure = range_figure(steps)
    assert figure is not None
    left = figure.axes[0]
    pixels = _pixels(figure)
    box = left.get_window_extent()
    height = len(pixels)
    inside = pixels[height - int(box.y1) : height - int(box.y0), int(box.x0) : int(box.x1)].astype(int)
    first_colour = np.array([0x00, 0x72, 0xB2])
    assert np.sum(abs(inside - first_colour).sum(axis=2) < 20) > 8


@pytest.mark.parametrize("axes", [0, 1])
def test_legends_lie_outside_of_what_is_drawn(rehearsal: dict[str, Any], axes: int) -> None:
    figure = range_figure(rehearsal["steps"])
    assert figure is not None
    _pixels(figure)
    legend = figure.axes[axes].get_legend()
    assert legend is not None
    assert legend.get_window_extent().y0 >= figure.axes[axes].get_window_extent().y1
