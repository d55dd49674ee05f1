"""What is wrong in a recording of a fault's trial is found, sample by sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.fault_trials import CHANNELS, judge
from drivers.virtual.tone import Tone
from recordings import Channel, Event, RunWriter, read_run
from recordings.run import Run

BLOCK = 256


@pytest.fixture
def tone() -> Tone:
    return Tone(list(CHANNELS))


@pytest.fixture
def run(tone, tmp_path) -> Run:
    """The tone of the line's channels as it was sent."""
    channels = [Channel(**{**each.__dict__, "device": "daq"}) for each in tone.channels if CHANNELS[each.name] == "daq"]
    with RunWriter(tmp_path / "run.mcap", info={"source": "simulated"}, channels=channels) as writer:
        for _ in range(8):
            block = tone.read(BLOCK)
            samples = {channel.name: block.samples[channel.name] for channel in channels}
            writer.write_block(replace(block, device="daq", samples=samples))
    return read_run(tmp_path / "run.mcap")


def changed(run: Run, **changes: object) -> Run:
    return replace(run, devices={"daq": replace(run.devices["daq"], **changes)})


def test_what_was_sent_is_not_wrong(run, tone):
    assert judge(run, tone) == (0, 2 * 8 * BLOCK)


def test_a_bit_a_shift_and_a_late_stamp_are_found(run, tone):
    device = run.devices["daq"]
    flipped = np.array(device.values["acc1"])
    flipped.view(np.uint32)[100] ^= 1
    assert judge(changed(run, values={**device.values, "acc1": flipped}), tone)[0] == 1
    shifted = {name: np.roll(values, 1) for name, values in device.values.items()}
    assert judge(changed(run, values=shifted), tone)[0] > 2 * 7 * BLOCK
    assert judge(changed(run, block_time_ns=device.block_time_ns + 300), tone)[0] == 2 * 8 * BLOCK


def test_a_stuck_sensor_is_wrong_where_no_event_says_so(run, tone):
    device = run.devices["daq"]
    stuck = np.array(device.values["acc1"])
    stuck[600:1200] = stuck[600]
    held = changed(run, values={**device.values, "acc1": stuck})
    fault = "stuck:channel=acc1,at_s=0.5"
    assert judge(held, tone, fault)[0] == 599
    rate = tone.sample_rate_Hz
    began = Event(time_ns=round(600e9 / rate), source="acc1", kind="stuck")
    ended = Event(time_ns=round(1190e9 / rate), source="acc1", kind="moves-again")
    assert judge(replace(held, events=(began, ended)), tone, fault)[0] == 10
    assert judge(replace(held, events=(began,)), tone, fault)[0] == 0
