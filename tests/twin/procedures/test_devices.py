"""One rig on two devices: their own blocks, indices and losses, one time base."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from resonator import ListSink, Resonator

from recordings.run import Channel, SampleBlock
from twin.procedures import DirectAcquisition, SteppedSine, run_procedure
from twin.procedures.tables import Measure

NODE_RATE, LATE_S = 1024.0, 0.00031  # the node samples at half the rate, 0.31 ms after the other


class TwoDevices(DirectAcquisition):
    """The resonator's ``acc`` comes from a device of its own, in blocks of 100, some of which are lost."""

    def __init__(self, source, lost=(), silent_after_s=1e9):
        super().__init__(source)
        self.lost, self.silent_after_s = set(lost), silent_after_s
        self.waiting, self.sent = np.empty(0), 0
        self.history = np.empty(0)

    @property
    def channels(self):
        force, acc = super().channels
        return [force, Channel(**{**vars(acc), "device": "node"})]

    def read(self, *, timeout_s=2.0):
        (block,) = super().read(timeout_s=timeout_s)
        acc = block.samples["acc"].astype(float)
        # exact samples of the node are not to be had from the other's; a band-limited signal may be interpolated
        self.history = np.r_[self.history, acc]
        wanted = np.arange(self.sent + len(self.waiting), int((len(self.history) - 8) / 2))
        t = (wanted / NODE_RATE + LATE_S) * 2048
        self.waiting = np.r_[self.waiting, _interpolate(self.history, t)]
        blocks = [replace(block, samples={"force": block.samples["force"]}, overload={})]
        while len(self.waiting) >= 100:
            first, now, self.waiting = self.sent, self.waiting[:100], self.waiting[100:]
            self.sent += 100
            time_ns = round((first / NODE_RATE + LATE_S) * 1e9)
            if first // 100 not in self.lost and time_ns < self.silent_after_s * 1e9:
                blocks.append(
                    SampleBlock(
                        device="node", time_ns=time_ns, first_index=first, sample_rate_Hz=NODE_RATE,
                        samples={"acc": now.astype(np.float32)},
                    )
                )  # fmt: skip
        return blocks


def _interpolate(values, at):
    """Cubic Lagrange interpolation; at 77 samples a period its error is below 1e-6."""
    i = np.floor(at).astype(int)
    u = at - i
    y = [values[np.maximum(i + k, 0)] for k in (-1, 0, 1, 2)]
    return (
        -u * (u - 1) * (u - 2) / 6 * y[0]
        + (u + 1) * (u - 1) * (u - 2) / 2 * y[1]
        - (u + 1) * u * (u - 2) / 2 * y[2]
        + (u + 1) * u * (u - 1) / 6 * y[3]
    )


def run(acquisition, **fields):
    sink = ListSink()
    procedure = SteppedSine(frequencies=[26.2, 26.6], amplitudes=[1.5], measure=Measure(seconds=2.0), **fields)
    return run_procedure(procedure, acquisition, sink), sink


def test_phases_between_devices_are_those_of_their_time_stamps():
    rig = Resonator()
    result, _ = run(TwoDevices(rig))
    for step in result.steps:
        exact = -((2 * np.pi * step.frequency_Hz) ** 2) * rig.receptance(step.frequency_Hz)
        assert step.phasors["acc"] / step.phasors["force"] == pytest.approx(exact, rel=1e-3)


def test_each_device_keeps_its_count_without_the_waits():
    result, sink = run(TwoDevices(Resonator()), store="settled")
    for device, rate in (("daq", 2048.0), ("node", 1024.0)):
        blocks = [block for block in sink.blocks if block.device == device]
        assert sum(map(len, blocks)) == pytest.approx(sum(s.measure_s for s in result.steps) * rate, abs=2)
        ends = [block.first_index + len(block) for block in blocks]
        assert [block.first_index for block in blocks] == [0, *ends[:-1]]


def test_a_loss_within_a_measurement_stays_a_jump_and_the_rest_is_used():
    rig = Resonator()
    clean, _ = run(TwoDevices(rig))
    # the first step is measured after settle_s: take blocks from the middle of it
    start = round((clean.steps[0].settle_s + 0.9) * NODE_RATE / 100)
    result, sink = run(TwoDevices(Resonator(), lost=[start, start + 1]), store="settled")
    node = [block for block in sink.blocks if block.device == "node"]
    jumps = [b.first_index - a.first_index - len(a) for a, b in pairwise(node)]
    assert sum(jumps) == 200
    assert len(result.steps) == 2
    exact = -((2 * np.pi * 26.2) ** 2) * rig.receptance(26.2)
    assert result.steps[0].phasors["acc"] / result.steps[0].phasors["force"] == pytest.approx(exact, rel=1e-3)


def test_a_device_that_falls_silent_ends_the_run_and_is_named():
    result, sink = run(TwoDevices(Resonator(), silent_after_s=10.0))
    assert result.state == "aborted"
    assert "'node'" in result.reason
    assert sink.events[-1].kind == "timeout"
