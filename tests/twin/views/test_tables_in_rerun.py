"""Tables of sweeps and of natural frequencies as views, read back with rerun's own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recorded_views import columns, value_at, verify, view_origins

from recordings.tables import read_table
from twin.views.rerun.table import save_table

SWEEPS = Path(__file__).parents[2] / "data" / "brake-reuss" / "response_control.csv"


def test_every_sweep_of_a_table_is_drawn_at_its_height(tmp_path: Path) -> None:
    path = tmp_path / "view.rrd"
    save_table(read_table(SWEEPS), path)
    verify(path)
    found = columns(path)
    assert {"/about", "/sweeps/receptance", "/sweeps/response", "/sweeps/force"} <= set(view_origins(path))
    table = np.genfromtxt(SWEEPS, delimiter=",", names=True)
    steps = found["/sweeps/force/7/steps"]["Points2D:positions"][-1]
    assert len(steps) == np.sum(table["level"] == 7)
    highest = min(place for _, place in steps)  # a picture's second axis points down
    assert value_at(found["/sweeps/force/axes/y"], highest) == pytest.approx(
        table["force_N"][table["level"] == 7].max(), rel=2e-3
    )


def test_natural_frequencies_have_a_colour_a_preload(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text("mode,frequency_Hz,preload\n1,26.4,120N\n2,120,120N\n1,27,540N\n2,125,540N\n")
    save_table(read_table(tmp_path / "f.csv"), tmp_path / "view.rrd")
    verify(tmp_path / "view.rrd")
    found = columns(tmp_path / "view.rrd")
    assert all(len(found[f"/frequencies/{state}"]["Points2D:positions"][-1]) == 2 for state in ("120N", "540N"))
