"""Where two causes explain the data alike, the next test is a procedure that can be run."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.candidate import Blame, Candidate
from twin.diagnose.causes import CAUSES
from twin.diagnose.next_test import plan_next_test
from twin.identify.evidence import gather_evidence
from twin.procedures import Random, SteppedSine, load_procedure
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def learnt(campaign):
    runs = tuple(read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps"))
    return runs, gather_evidence(runs, load_rig("steel-lap-joint"))


def rivals(evidence, gap: float, *names: str) -> tuple[Candidate, ...]:
    """Models of one cause each, their log evidence `gap` apart."""
    models = []
    for k, name in enumerate(names):
        values = {p.name: (p.starts or (p.lower,))[0] for p in CAUSES[name].parameters(evidence, {})}
        solution = cast("Any", SimpleNamespace(chi2=100.0))
        blame = Blame(CAUSES[name], {}, values, {})
        models.append(Candidate((blame,), cast("Any", None), solution, -gap * k, 100))
    return tuple(models)


def test_linear_rivals_want_longer_noise_in_the_same_band(learnt, tmp_path):
    runs, evidence = learnt
    proposed = plan_next_test(runs, evidence, rivals(evidence, 2.0, "added-mass", "clamp-compliance"), tmp_path)
    assert proposed is not None
    assert "added-mass from clamp-compliance" in proposed.why
    procedure = load_procedure(tmp_path / proposed.procedure)
    assert isinstance(procedure, Random)
    # Twice the gap at which rivals are told apart, from two: five times as long as the 30 s that were measured.
    assert procedure.duration == pytest.approx(5 * 30.0, rel=0.25)
    assert procedure.rms == pytest.approx(0.5, rel=0.1)


def test_nonlinear_rivals_want_the_largest_sweep_measured_longer(learnt, tmp_path):
    runs, evidence = learnt
    proposed = plan_next_test(runs, evidence, rivals(evidence, 1.0, "joint-friction", "joint-uneven"), tmp_path)
    assert proposed is not None
    procedure = load_procedure(tmp_path / proposed.procedure)
    assert isinstance(procedure, SteppedSine)
    assert procedure.amplitudes == [6.0]
    assert procedure.measure.seconds == pytest.approx(10.0)
    assert np.min(procedure.frequencies) == pytest.approx(25.6)


def test_a_clear_winner_wants_no_test(learnt, tmp_path):
    runs, evidence = learnt
    assert plan_next_test(runs, evidence, rivals(evidence, 50.0, "added-mass", "clamp-compliance"), tmp_path) is None
    assert not list(tmp_path.iterdir())
