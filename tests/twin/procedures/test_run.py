"""What is written while a procedure runs, and what happens when it cannot go on."""

import numpy as np
import pytest
from resonator import ListSink, Resonator

from recordings.errors import InputError
from recordings.run import Event, StepState
from twin.procedures import DirectAcquisition, Dwell, Random, RingDown, SteppedSine, SweptSine, run_procedure
from twin.procedures.sine_fit import fit_sine
from twin.procedures.tables import Limits, Measure, Settle

SWEEP = {"frequencies": [26.0, 26.4, 26.6], "amplitudes": [1.5], "measure": Measure(seconds=1.0)}


class Wire(DirectAcquisition):
    """A direct acquisition with the troubles of a wire: late changes, two devices, silence, interrupts."""

    def __init__(self, source, *, latency_s=0.0, silent_after_s=1e9, interrupt_after_s=1e9, broken_after_s=1e9):
        super().__init__(source, block_s=0.1)
        self.latency_s, self.stopped, self.held = latency_s, 0, []
        self.troubles = {TimeoutError: silent_after_s, KeyboardInterrupt: interrupt_after_s, OSError: broken_after_s}
        self.source, self.now_s = source, 0.0

    def set_output(self, excitation):
        # the samples of the next `latency_s` still belong to the old output
        if excitation.kind != "off" and self.latency_s:
            self.held += super().read()
        return super().set_output(excitation)

    def read(self, *, timeout_s=2.0):
        blocks, self.held = [*self.held, *super().read(timeout_s=timeout_s)], []
        self.now_s = blocks[-1].time_ns * 1e-9
        for trouble, after_s in self.troubles.items():
            if self.now_s > after_s:
                raise trouble("cable pulled")
        return blocks

    def stop(self):
        self.stopped += 1
        super().stop()

    def take_events(self):
        return [Event(time_ns=0, source="daq", kind="checksum")] if 1.0 < self.now_s < 1.05 else []


def run(wire, **fields):
    sink = ListSink()
    return run_procedure(SteppedSine(**{**SWEEP, **fields}), wire, sink), sink


def test_late_changes_do_not_disturb_the_control():
    result, _ = run(Wire(Resonator(back_emf_ratio=3.0), latency_s=0.1))
    assert max(abs(step.amplitude_error) for step in result.steps) < 0.003


def test_states_of_a_sweep_come_in_order():
    _, sink = run(Wire(Resonator()))
    states = [(step.index, step.state) for step in sink.steps]
    expected = [(i, state) for i in range(3) for state in (StepState.SETTLING, StepState.MEASURING)]
    assert states == [*expected, (2, StepState.DONE)]
    times = [step.time_ns for step in sink.steps]
    assert times == sorted(times)


@pytest.mark.parametrize("store", ["all", "settled"])
def test_no_two_steps_share_a_time_stamp(store):
    _, sink = run(Wire(Resonator()), direction="both", settle=Settle(seconds=0.0), store=store)
    times = [step.time_ns for step in sink.steps]
    assert len(times) == 2 * (2 * 3 + 1)
    assert np.all(np.diff(times) > 0)


def test_a_recording_of_its_own_accord_lasts_as_long_as_the_rig_ran():
    result, sink = run(Wire(Resonator()))
    last = sink.blocks[-1]
    assert last.time_ns * 1e-9 + len(last) / 2048 - sink.blocks[0].time_ns * 1e-9 >= result.duration_s


def test_everything_is_stored_as_it_came():
    result, sink = run(Wire(Resonator()), store="all")
    indices = [block.first_index for block in sink.blocks]
    lengths = [len(block) for block in sink.blocks]
    assert indices == list(np.cumsum([0, *lengths[:-1]]))
    assert sum(lengths) / 2048 >= result.duration_s


def test_without_the_waits_indices_and_times_run_on():
    result, sink = run(Wire(Resonator()), store="settled")
    measured = round(sum(step.measure_s * 2048 for step in result.steps))
    assert sum(len(block) for block in sink.blocks) == measured
    for before, after in zip(sink.blocks, sink.blocks[1:], strict=False):
        assert after.first_index == before.first_index + len(before)
        assert after.time_ns == pytest.approx(before.time_ns + len(before) / 2048 * 1e9, abs=2)
    starts = [step.time_ns for step in sink.steps if step.state == StepState.MEASURING]
    first_indices = [0, *(np.cumsum([round(step.measure_s * 2048) for step in result.steps])[:-1])]
    for start, index in zip(starts, first_indices, strict=True):
        assert start == pytest.approx(sink.blocks[0].time_ns + index / 2048 * 1e9, abs=5)


def test_stored_stretches_hold_what_was_measured():
    result, sink = run(Wire(Resonator()), store="settled")
    samples = np.concatenate([block.samples["force"] for block in sink.blocks])
    starts = np.cumsum([0, *(round(step.measure_s * 2048) for step in result.steps)])
    for step, first, last in zip(result.steps, starts, starts[1:], strict=False):
        fit = fit_sine(samples[first:last], frequency_Hz=step.frequency_Hz, sample_rate_Hz=2048.0)
        assert abs(fit.phasor) == pytest.approx(step.amplitude, rel=1e-6)


@pytest.mark.parametrize("store", ["all", "settled"])
def test_a_guard_switches_off_and_ends_the_run(store):
    wire = Wire(Resonator())
    result, sink = run(wire, frequencies=[26.0, 26.45, 26.5], limits=Limits(peak={"acc": 20.0}), store=store)
    assert result.state == "aborted"
    assert "acc reached 20" in result.reason
    assert wire.stopped >= 1
    assert wire.source._excitation.kind == "off"
    assert sink.steps[-1].state == StepState.ABORTED
    assert [event.kind for event in sink.events if event.source == "acc"] == ["limit"]
    assert len(result.steps) < 3  # what was measured before is kept


@pytest.mark.parametrize(
    ("trouble", "state", "kind"),
    [
        ("silent_after_s", "aborted", "timeout"),
        ("interrupt_after_s", "interrupted", "interrupted"),
        ("broken_after_s", "aborted", "disconnected"),
    ],
)
def test_silence_interrupts_and_lost_connections_leave_a_safe_rig(trouble, state, kind):
    wire = Wire(Resonator(), **{trouble: 30.0})
    result, sink = run(wire)
    assert result.state == state
    assert kind in [event.kind for event in sink.events]
    assert sink.steps[-1].state == StepState.ABORTED
    assert wire.source._excitation.kind == "off"
    assert len(sink.blocks) > 0


def test_events_of_the_wire_are_written():
    _, sink = run(Wire(Resonator()))
    assert ("daq", "checksum") in [(event.source, event.kind) for event in sink.events]


def test_overload_is_written_once_a_step_and_channel():
    _, sink = run(Wire(Resonator(acc_range=3.0)), frequencies=[26.4, 26.5])
    assert [(e.kind, e.source) for e in sink.events if e.kind == "overload"] == [("overload", "acc")] * 2


def test_random_reaches_its_rms():
    sink = ListSink()
    random = Random(band=(5.0, 500.0), rms=0.5, duration=10.0, sample_rate=2048.0, store="settled")
    result = run_procedure(random, Wire(Resonator()), sink)
    assert result.steps[0].amplitude == pytest.approx(0.5, rel=0.1)
    samples = np.concatenate([block.samples["force"] for block in sink.blocks])
    assert len(samples) == 10 * 2048
    assert np.std(samples) == pytest.approx(result.steps[0].amplitude, rel=1e-3)
    assert [step.state for step in sink.steps] == [StepState.SETTLING, StepState.MEASURING, StepState.DONE]
    assert all(step.frequency_Hz == 0.0 for step in sink.steps)


def test_a_ring_down_shows_the_damping_with_the_generator_off():
    sink = ListSink()
    rig = Resonator(back_emf_ratio=0.0)
    procedure = RingDown(frequency=26.5, duration=4.0, amplitudes=[1.5], measure=Measure(seconds=1.0))
    result = run_procedure(procedure, Wire(rig), sink)
    assert [step.target_amplitude for step in result.steps] == [1.5, 0.0]
    decay = np.concatenate([block.samples["acc"] for block in sink.blocks])[-4 * 2048 :].astype(float)
    energy = [np.mean(decay[i : i + 2048] ** 2) for i in (0, 2048, 4096)]
    damping = np.log(energy[0] / energy[2]) / (2 * 2.0 * 2 * np.pi * rig.frequency_Hz)
    assert damping == pytest.approx(rig.damping_ratio, rel=0.01)


def test_a_dwell_is_measured_for_its_duration():
    sink = ListSink()
    result = run_procedure(
        Dwell(frequency=26.4, duration=7.5, amplitudes=[1.0], store="settled"), Wire(Resonator()), sink
    )
    assert result.steps[0].measure_s == 7.5
    assert sum(len(block) for block in sink.blocks) == round(7.5 * 2048)


def test_a_swept_sine_passes_through_its_range():
    sink = ListSink()
    rig = Resonator(damping_ratio=0.05)
    run_procedure(SweptSine(start=20.0, stop=30.0, rate=1.0, voltages=[0.1], store="settled"), Wire(rig), sink)
    force = np.concatenate([block.samples["force"] for block in sink.blocks]).astype(float)
    crossings = np.flatnonzero(np.diff(np.sign(force)) > 0) / 2048
    frequency = 1 / np.diff(crossings)
    assert np.median(frequency[:10]) == pytest.approx(20.2, abs=0.3)
    assert np.median(frequency[-10:]) == pytest.approx(29.8, abs=0.3)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"target_channel": "torque"}, "target_channel"),
        ({"limits": Limits(peak={"acc9": 1.0})}, "limits.peak.acc9"),
        ({"control": "response"}, "control"),
    ],
)
def test_what_the_rig_does_not_have_is_refused_before_anything_moves(fields, place):
    wire = Wire(Resonator())
    with pytest.raises(InputError) as caught:
        run(wire, **fields)
    assert caught.value.place == place
    assert wire.source._index == 0


def test_fixed_waits_are_kept_to_the_sample():
    result, _ = run(Wire(Resonator()), settle=Settle(seconds=1.5))
    assert [step.settle_s for step in result.steps] == pytest.approx([1.5] * 3, abs=1e-3)
    assert [step.settled for step in result.steps] == [None] * 3
