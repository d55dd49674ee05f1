"""A diagnosis at hand in Python: its tables, its pictures, and the extended model to go on with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from twin.diagnose.answer.result import Diagnosis
from twin.lab.diagnosed import DiagnosedRecordings
from twin.rigs import Rig


@pytest.fixture(scope="module")
def found(diagnosis: Diagnosis) -> DiagnosedRecordings:
    return DiagnosedRecordings(diagnosis)


def test_it_reads_as_an_answer_and_tables(found: DiagnosedRecordings) -> None:
    text = repr(found)
    assert text.startswith(found.sentence)
    assert "mass 8.000 ± 0.008 g at 350.00 ± 0.05 mm" in text
    assert "0.77 %" in text


def test_strangers_names_stay_text(found: DiagnosedRecordings) -> None:
    assert "<b>sits</b>" in found.sentence
    assert "<b>" not in found._repr_html_()
    assert "&lt;b&gt;sits" in found._repr_html_()


def test_its_pictures_are_figures(found: DiagnosedRecordings) -> None:
    for draw in (found.plot_sweeps, found.plot_held_out, found.plot_residuals, found.plot_law, found.plot_modes):
        assert isinstance(draw(), Figure)
    assert isinstance(found.plot_broadband(), Figure)
    with pytest.raises(ValueError, match="none is number 1"):
        found.plot_broadband(1)
    with pytest.raises(ValueError, match="no force"):
        found.plot_missing_force()


def test_residuals_are_drawn_at_their_size(found: DiagnosedRecordings) -> None:
    drawn = [np.max(line.get_ydata()) for axes in found.plot_residuals().axes for line in axes.get_lines()]
    assert max(drawn) == pytest.approx(max(float(s.residual_before.max()) for s in found.diagnosis.sweeps))


def test_sweeps_that_are_not_there_are_told(diagnosis: Diagnosis) -> None:
    with pytest.raises(ValueError, match="no sweeps were held out"):
        DiagnosedRecordings(replace(diagnosis, held_out=())).plot_held_out()


def test_the_extended_model_carries_what_was_blamed(found: DiagnosedRecordings, diagnosis: Diagnosis) -> None:
    rig = found.rig.file
    assert isinstance(rig, Rig)
    (effect,) = rig.effect
    assert effect.cause == "added-mass"
    assert effect.parameters["mass_kg"] == 0.008
    innocent = DiagnosedRecordings(replace(diagnosis, verdict="none")).rig.file
    assert isinstance(innocent, Rig)
    assert innocent.effect == []


def test_it_is_saved_whole(found: DiagnosedRecordings, tmp_path: Path) -> None:
    assert found.save(tmp_path / "deep" / "kept")["extended_model"] == "extended.toml"
    assert sorted(path.name for path in (tmp_path / "deep" / "kept").iterdir()) == ["extended.toml", "view.rrd"]
