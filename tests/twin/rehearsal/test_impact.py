"""An impact test rehearsed: records that end before the lowest mode has decayed are told, and lengthened."""

from __future__ import annotations

import math

import pytest

from recordings import InputError, read_run
from recordings.sweeps import sweeps
from twin.procedures import Impact
from twin.rehearsal import NominalRig, open_twin, rehearse, rehearse_until_clear
from twin.rehearsal.hammer import point_places
from twin.rigs import load_rig

RIG = load_rig("hung-lap-joint")
POINTS = [{"name": "left", "part": "lower", "at": 0.0}, {"name": "right", "part": "upper", "at": 0.235}]


def bench(procedure):
    return open_twin(RIG, procedure, preload="120N", seed=3, source="hung")


def test_records_that_end_too_early_are_told_and_lengthened(tmp_path):
    hammer = {"peak": 5.0, "scatter": 0.1, "width": 3e-4}
    asked = Impact(record=0.5, hits=2, trigger=0.5, point=POINTS, hammer=hammer)
    nominal = NominalRig.of(RIG, preload="120N")
    first = rehearse(asked, bench(asked), tmp_path / "run.mcap", nominal=nominal)
    (caution,) = first.cautions
    assert (caution.kind, caution.severity) == ("too-short", "warning")
    assert all(step.amplitude == pytest.approx(5.0, rel=0.35) for step in first.rehearsal.result.steps)
    better = rehearse_until_clear(first, bench, tmp_path / "better.mcap")
    assert better.clear
    record_s = better.rehearsal.procedure.record
    assert math.exp(-0.0015 * 2 * math.pi * 175.2 * record_s) < 0.05
    stretches = [(sweep.name, len(sweep.stretches)) for sweep in sweeps(read_run(tmp_path / "better.mcap"))]
    assert stretches == [("left", 2), ("right", 2)]


def test_a_roving_accelerometer_keeps_its_direction():
    across = [{**POINTS[0], "direction": "+x"}]
    asked = Impact(record=1.0, roving="accelerometer", sensor="acc1", point=across)
    assert point_places(asked)["left"].direction == (1.0, 0.0, 0.0)
    with pytest.raises(InputError, match="keeps its direction"):
        bench(asked)
