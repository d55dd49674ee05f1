"""Impact procedures: each record begins before its hit, and what cannot be meant is refused."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import Channel, InputError
from recordings.run import SampleBlock, StepState
from twin.procedures import DirectAcquisition, Impact, dump_procedure, parse_procedure, planned_steps, run_procedure

RATE_Hz = 2000.0


class Struck:
    """A force that is a spike of three samples at given times, for as long as it is read."""

    def __init__(self, times_s, peak_N=10.0):
        self.channels = [
            Channel(name="force", quantity="force", unit="N", range=50.0),
            Channel(name="acc", quantity="acceleration", unit="m/s^2", range=50.0),
        ]
        self.sample_rate_Hz, self.index = RATE_Hz, 0
        self.hits = [round(t * RATE_Hz) for t in times_s]
        self.peak_N = peak_N

    def set_sample_rate(self, sample_rate_Hz):
        return self.sample_rate_Hz

    def set_output(self, excitation):
        assert excitation.kind == "off"

    def read(self, count):
        n = np.arange(self.index, self.index + count)
        force = np.zeros(count, np.float32)
        for at in self.hits:
            force[(n >= at) & (n < at + 3)] = self.peak_N
        first, self.index = self.index, self.index + count
        return SampleBlock(
            device="daq", time_ns=round(first / RATE_Hz * 1e9), first_index=first, sample_rate_Hz=RATE_Hz,
            samples={"force": force, "acc": n.astype(np.float32)}, overload={"force": 0, "acc": 0},
        )  # fmt: skip


class Kept:
    """What a run would write."""

    def __init__(self):
        self.blocks, self.steps, self.events = [], [], []
        self.write_block, self.write_step, self.write_event = self.blocks.append, self.steps.append, self.events.append

    def write_indicator(self, indicator):
        pass


POINTS = [{"name": "a", "part": "p", "at": 0.1}, {"name": "b", "part": "p", "at": 0.2}]
ASKED = {"sample_rate": RATE_Hz, "record": 0.5, "pre_trigger": 0.05, "hits": 2, "point": POINTS}


@pytest.mark.parametrize("store", ["all", "settled"])
def test_each_record_begins_before_its_hit(store):
    times_s, kept = [1.0123, 2.2, 3.4, 4.7], Kept()
    procedure = Impact(**ASKED, store=store)
    result = run_procedure(procedure, DirectAcquisition(Struck(times_s)), kept)
    assert result.state == "done"
    assert [(step.sweep, step.index) for step in result.steps] == [("a", 0), ("a", 1), ("b", 0), ("b", 1)]
    assert all(step.amplitude == pytest.approx(10.0) for step in result.steps)
    measured = [step for step in kept.steps if step.state == StepState.MEASURING]
    assert {step.frequency_Hz for step in measured} == {0.0}
    if store == "all":
        starts_s = [step.time_ns * 1e-9 for step in measured]
        assert starts_s == pytest.approx([t - 0.05 for t in times_s], abs=1 / RATE_Hz)
    else:
        force = np.concatenate([block.samples["force"] for block in kept.blocks])
        assert len(force) == 4 * round(0.5 * RATE_Hz)
        assert np.flatnonzero(np.diff(force) > 0) == pytest.approx([99 + 1000 * n for n in range(4)], abs=1)


def test_a_hit_that_does_not_come_ends_the_run_and_says_where():
    for struck in (Struck([1.0]), Struck([1.0, 2.0], peak_N=1.0)):
        kept = Kept()
        result = run_procedure(Impact(**ASKED, patience=3.0), DirectAcquisition(struck), kept)
        assert result.state == "aborted"
        assert "no hit at a beyond 2 N within 3 s" in result.reason
        assert kept.steps[-1].state == StepState.ABORTED


def test_it_is_written_and_read_back():
    procedure = Impact(**ASKED, hammer={"double_hits": [3]})
    assert parse_procedure(dump_procedure(procedure), source="impact.toml") == procedure
    assert planned_steps(procedure) == 4
    assert planned_steps(Impact(record=1.0, hits=3)) == 3


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"pre_trigger": 0.6}, "shorter than record"),
        ({"sensor": "acc"}, "accelerometer"),
        ({"roving": "accelerometer"}, "accelerometer"),
        ({"point": [POINTS[0], POINTS[0]]}, "unique"),
        ({"trigger": 29.0}, "not reached"),
        ({"hammer": {"double_hits": [5]}}, "there are 4 hits"),
        ({"point": [{**POINTS[0], "direction": "up"}]}, "direction"),
    ],
)
def test_what_cannot_be_meant_is_refused(fields, reason):
    with pytest.raises(ValueError, match=reason):
        Impact(**{**ASKED, **fields})


def test_a_sensor_that_the_rig_has_not_is_refused_before_anything_moves():
    procedure = Impact(**ASKED, roving="accelerometer", sensor="acc7")
    with pytest.raises(InputError, match="no channel 'acc7'"):
        run_procedure(procedure, DirectAcquisition(Struck([1.0])), Kept())
