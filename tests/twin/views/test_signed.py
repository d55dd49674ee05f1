"""A report tells when, by what and from which files it was made, and why its cause and no other."""

from __future__ import annotations

import hashlib
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from twin.diagnose.posterior import Weighed
from twin.views.page import Page
from twin.views.receptance import phase_deg
from twin.views.reports.answer import rivals_table


def test_a_page_tells_the_files_that_it_was_made_from(tmp_path: Path) -> None:
    recording = tmp_path / "run.mcap"
    recording.write_bytes(b"samples")
    files = (str(recording), str(recording), "steel-lap-joint")
    page = Page(title="t", answer="a", facts="f", sections=[], files=files)
    page.write(tmp_path / "report.html", commands=["twin diagnose run.mcap"])
    for text in ((tmp_path / "report.html").read_text(encoding="utf-8"), page.markdown()):
        assert text.count(hashlib.sha256(b"samples").hexdigest()) == 1
        assert version("virtual-test-rig") in text
        assert "steel-lap-joint" not in text


def test_rivals_are_told_by_how_far_they_fall_behind() -> None:
    told = rivals_table(
        [Weighed("none", 0, 10.0, 0.0), Weighed("added-mass", 1, 40.0, -4.6), Weighed("drive-mass", 1, 34.0, -4.6)], 2.0
    )
    assert told.caption.startswith("How far added-mass is ahead")
    assert told.rows == [("drive-mass", "+3.0", "+0.0"), ("no cause at all", "+15.0", "-4.6")]


@pytest.mark.parametrize(("quantity", "turn"), [("acceleration", -1.0), ("velocity", 1j), ("displacement", 1.0)])
def test_the_phase_is_the_motions_and_does_not_wrap_at_a_resonance(quantity: str, turn: complex) -> None:
    f = np.linspace(0.9, 1.1, 41)
    motion = 1 / (1 - f**2 + 0.02j * f)
    np.testing.assert_allclose(phase_deg(turn * motion, quantity), np.degrees(np.angle(motion)), atol=1e-9)
    np.testing.assert_allclose(phase_deg(-turn * motion, quantity)[0], np.degrees(np.angle(motion))[0] - 180.0)
