"""Benchmarks of wires and files compare what they say they compare: every sample arrives, and arrives unchanged."""

import pytest

from benchmarks.wires import BENCHMARKS, acquisition, can_fd_at_capacity, framed_serial, recording

HALF_A_STEP = 0.501
"""Of the node's converter: its rounding."""


def test_frames_arrive_unchanged():
    found = framed_serial(size_bytes=1 << 20, rounds=1)
    assert found.error == 0.0
    assert found.more["framed_MB_per_s"] == pytest.approx(found.ratio * found.more["raw_MB_per_s"])


def test_what_is_recorded_is_what_was_written():
    assert recording(count=20, rounds=1).error == 0.0


@pytest.mark.nightly
def test_an_acquisition_in_real_time_is_whole():
    found = acquisition(seconds=1.0)
    assert found.error == 0.0
    assert found.more["cores_used"] > 0


@pytest.mark.nightly
def test_a_bus_at_its_capacity_loses_nothing():
    found = can_fd_at_capacity(seconds=1.0)
    assert 0 < found.error < HALF_A_STEP


@pytest.mark.nightly
@pytest.mark.parametrize("name", BENCHMARKS)
def test_promises_are_kept(name):
    found = BENCHMARKS[name]()
    assert found.ratio >= found.promise, found


@pytest.mark.nightly
def test_a_bus_at_its_capacity_loses_nothing_for_a_minute():
    found = can_fd_at_capacity(seconds=60.0)
    assert found.error < HALF_A_STEP
    assert found.ratio >= 0.95
