"""Losses, late and doubled blocks, restarts, and which sample was taken when."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_builders import CHANNELS, INFO, START_NS, ForeignWriter, RATE_Hz, block_at, step_at, write_run

from recordings import Gap, InputError, Limits, Run, RunWriter, SampleBlock, StepState, read_run, sweeps
from recordings.container.assemble import Assembler
from recordings.run import DeviceSamples
from recordings.sweeps import measured_stretches

FOREIGN = Path(__file__).parents[1] / "data" / "recordings" / "foreign.mcap"


def assembled(*blocks: SampleBlock, limits: Limits | None = None) -> tuple[DeviceSamples, list[str]]:
    assembler = Assembler("daq", limits or Limits())
    for block in blocks:
        assembler.add(block)
    device = assembler.finish()
    assert device is not None
    return device, [event.kind for event in assembler.notices()]


def changed(block: SampleBlock, **changes: object) -> SampleBlock:
    return SampleBlock(**{**block.__dict__, **changes})


def test_lost_samples_are_nan_and_counted() -> None:
    device, notices = assembled(block_at(0, 100), block_at(250, 100))
    assert device.gaps == (Gap(device="daq", first_index=100, count=150),)
    force = device.values["force"]
    assert len(force) == 350
    assert np.isnan(force[100:250]).all()
    np.testing.assert_array_equal(force[250:], block_at(250, 100).samples["force"])
    assert notices == []


def test_jump_by_two_to_the_sixty_costs_no_memory(tmp_path: Path) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.block(block_at(0))
    writer.block(changed(block_at(256), first_index=1 << 60))
    run = read_run(writer.finish(), limits=Limits(gap_fill=1000))
    device = run.devices["daq"]
    assert device.gaps == (Gap(device="daq", first_index=256, count=(1 << 60) - 256),)
    assert len(device) == 256 + 1000 + 256
    assert [event.kind for event in run.events] == ["time"]


@given(order=st.permutations(range(6)))
def test_late_blocks_find_their_place(order: list[int]) -> None:
    """Whatever the order of arrival, nothing is lost: time stamps tell a late block from a restart."""
    blocks = [block_at(number * 100, 100) for number in order]
    device, notices = assembled(*blocks)
    np.testing.assert_array_equal(device.values["acc1"], block_at(0, 600).samples["acc1"])
    assert device.gaps == ()
    assert ("order" in notices) == (order != sorted(order))


def test_doubled_blocks_are_taken_once() -> None:
    first, second = block_at(0, 100), block_at(100, 100)
    device, notices = assembled(first, second, first, second, block_at(50, 100), block_at(0, 300))
    np.testing.assert_array_equal(device.values["force"], block_at(0, 300).samples["force"])
    assert notices == ["duplicate"]


def test_two_values_for_one_sample_are_refused() -> None:
    with pytest.raises(ValueError, match="given twice with different values"):
        assembled(block_at(0, 100), block_at(50, 100, seed=1))


def test_restart_of_the_device_goes_on_by_the_clock() -> None:
    """Numbers begin again at 0 half a second later: the samples between are lost, not overwritten."""
    later = changed(block_at(0, 100), time_ns=START_NS + 500_000_000)
    device, notices = assembled(block_at(0, 100), block_at(100, 100), later, changed(later, first_index=100,
        time_ns=later.time_ns + round(100e9 / RATE_Hz)))  # fmt: skip
    assert notices == ["restart"]
    missed = round(0.5 * RATE_Hz) - 200
    assert device.gaps == (Gap(device="daq", first_index=200, count=missed),)
    assert len(device) == 400 + missed
    start = device.position_at(later.time_ns)
    np.testing.assert_array_equal(device.values["force"][start : start + 100], later.samples["force"])
    np.testing.assert_array_equal(device.times_ns(start, start + 1), [later.time_ns])


def test_stamps_that_jitter_are_told_but_not_refused() -> None:
    """A host that stamps blocks of 10 ms when they arrive is up to 60 ms late: the numbers still hold."""
    jitter_ns = [0, 60_000_000, 55_000_000, 50_000_000, 5_000_000, 0]
    blocks = [block_at(k * 256) for k in range(6)]
    device, notices = assembled(
        *(changed(b, time_ns=b.time_ns + late) for b, late in zip(blocks, jitter_ns[:4], strict=False))
    )
    np.testing.assert_array_equal(device.values["force"], block_at(0, 1024).samples["force"])
    assert set(notices) == {"time"}
    with pytest.raises(ValueError, match="contradict"):
        assembled(*(changed(b, time_ns=b.time_ns + late) for b, late in zip(blocks, jitter_ns, strict=True)))


def test_clock_that_drifts_is_followed_by_the_time_stamps() -> None:
    """100 ppm over 100 blocks: positions come from the stamps, not from the nominal rate."""
    length = 256
    blocks = [
        changed(block_at(k * length, length), time_ns=START_NS + round(k * length * 1e9 / RATE_Hz * 1.0001))
        for k in range(100)
    ]
    device, notices = assembled(*blocks)
    assert notices == []
    assert device.position_at(blocks[99].time_ns) == 99 * length
    assert device.position_at(blocks[99].time_ns - 1_000) == 99 * length


@given(start=st.integers(0, 3000), count=st.integers(0, 3000), rate=st.sampled_from([25600.0, 44100.0, 1024.0, 3.7]))
def test_samples_between_two_times_are_exactly_those(start: int, count: int, rate: float) -> None:
    """Against a plain comparison of each sample's time; the bounds are put midway between samples."""
    length = 128
    blocks = [
        changed(block_at(k * length, length), time_ns=START_NS + round(k * length * 1e9 / rate), sample_rate_Hz=rate)
        for k in range(24)
    ]
    device, _ = assembled(*blocks)
    run = Run(path="", info={}, channels={}, devices={"daq": device}, steps=(), events=())
    from_ns, to_ns = (START_NS + round((number - 0.5) * 1e9 / rate) for number in (start, start + count))
    times = device.times_ns()
    expected = device.values["force"][(times >= from_ns) & (times < to_ns)]
    np.testing.assert_array_equal(run.between("force", from_ns, to_ns), expected)


def test_a_block_tells_when_its_samples_were_taken() -> None:
    block = block_at(100, 50)
    assert block.time_at(0) == block.time_ns
    assert block.time_at(20) == block_at(120).time_ns
    assert block.end_ns == block_at(150).time_ns


def test_neighbouring_stretches_share_no_sample_and_lose_none(tmp_path: Path) -> None:
    run = read_run(write_run(tmp_path / "run.mcap", blocks=40))
    end = run.devices["daq"].end_ns
    bounds = [START_NS, *(START_NS + round(k * 1e9 / RATE_Hz) for k in (77, 1000, 1001, 5000)), end]
    parts = [run.between("acc1", a, b) for a, b in pairwise(bounds)]
    assert [len(part) for part in parts] == [77, 923, 1, 3999, 40 * 256 - 5000]
    with pytest.raises(KeyError, match="no samples of channel 'acc9'"):
        run.between("acc9", START_NS, end)


def test_sweeps_give_measured_stretches_up_to_the_next_message(tmp_path: Path) -> None:
    second = 1_000_000_000
    states = [
        (0, StepState.SETTLING, 0, "up"), (2, StepState.MEASURING, 0, "up"), (3, StepState.SETTLING, 1, "up"),
        (5, StepState.MEASURING, 1, "up"), (7, StepState.DONE, 1, "up"), (8, StepState.MEASURING, 0, "down"),
        (9, StepState.ABORTED, 0, "down"), (10, StepState.MEASURING, 1, "down"),
    ]  # fmt: skip
    channel = block_at(0)
    for stored in ("all", "settled"):
        path = tmp_path / f"{stored}.mcap"
        with RunWriter(path, info={**INFO, "stored": stored}, channels=CHANNELS) as writer:
            for at, state, index, sweep in reversed(states):  # order in the file does not matter
                writer.write_step(step_at(START_NS + at * second, state, index=index, sweep=sweep))
            writer.write_block(changed(channel, time_ns=START_NS + 11 * second))
        up, down = sweeps(run := read_run(path))
        assert measured_stretches(run) == [*up.stretches, *down.stretches]
        assert [(s.start_ns - START_NS, s.stop_ns - START_NS) for s in up.stretches] == [
            (2 * second, 3 * second), (5 * second, 7 * second),
        ]  # fmt: skip
        assert [s.settle_start_ns for s in up.stretches] == [START_NS, START_NS + 3 * second]
        assert [s.wait_s for s in up.stretches] == ([2.0, 2.0] if stored == "all" else [None, None])
        assert [s.ended_by for s in up.stretches] == [StepState.SETTLING, StepState.DONE]
        assert (up.name, up.state, down.state) == ("up", StepState.DONE, StepState.ABORTED)
        assert [s.settle_start_ns for s in down.stretches] == [None, None]
        assert down.stretches[0].ended_by is StepState.ABORTED
        assert down.stretches[1].ended_by is None
        assert down.stretches[1].stop_ns == START_NS + 11 * second + 10_000_000  # the end of the samples


def test_stretches_of_an_unrelated_program_hold_its_sines() -> None:
    """Each of 41 measured stretches of the foreign sweep is 2 s long and a sine of the stated frequency."""
    run = read_run(FOREIGN)
    (sweep,) = sweeps(run)
    assert sweep.state is StepState.DONE
    assert len(sweep.stretches) == 41
    for stretch in sweep.stretches:
        assert stretch.wait_s is None
        force = run.between(stretch.step.target_channel, stretch.start_ns, stretch.stop_ns).astype(float)
        assert len(force) == 2048
        phase = 2 * np.pi * stretch.step.frequency_Hz * np.arange(len(force)) / 1024.0
        basis = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        amplitude = np.linalg.norm(np.linalg.lstsq(basis, force, rcond=None)[0])
        assert amplitude == pytest.approx(stretch.step.target_amplitude, rel=0.02)


def test_contradiction_in_the_file_names_the_message(tmp_path: Path) -> None:
    writer = ForeignWriter(tmp_path / "run.mcap")
    writer.block(block_at(0))
    writer.block(block_at(128, seed=2))
    with pytest.raises(InputError, match=r"message 2 of '/samples/daq'.*given twice"):
        read_run(writer.finish())
