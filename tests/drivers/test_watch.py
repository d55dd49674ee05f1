"""A sensor that keeps one value is told with the time from which on it does, and when it moves again."""

import numpy as np
import pytest

from drivers.host.device import Mailbox
from drivers.host.watch import ChannelWatch

RATE_Hz = 1000.0


def looked_at(samples: np.ndarray, block: int, overload: list[int] | None = None) -> list[tuple[str, int]]:
    """Kind and time in samples of every event."""
    mailbox = Mailbox()
    watch = ChannelWatch("acc1", mailbox)
    for number, start in enumerate(range(0, len(samples), block)):
        hits = overload[number] if overload else 0
        watch.look(samples[start : start + block], hits, round(start * 1e9 / RATE_Hz), RATE_Hz)
    return [(event.kind, round(event.time_ns * 1e-9 * RATE_Hz)) for event in mailbox.take_events()]


@pytest.mark.parametrize("block", [30, 240, 500])
def test_stuck_from_a_sample_to_a_sample(block):
    samples = np.random.default_rng(0).standard_normal(6000).astype(np.float32)
    samples[1000:2500] = samples[1000]
    found = looked_at(samples, block)  # blocks of an acquisition are shorter than half a second
    assert found == [("stuck", 1000), ("moves-again", 2500)]


def test_a_value_held_for_less_than_half_a_second_is_no_fault():
    samples = np.random.default_rng(0).standard_normal(3000).astype(np.float32)
    samples[1000:1490] = samples[1000]
    assert looked_at(samples, 100) == []


def test_overload_begins_and_ends_once():
    assert looked_at(np.random.default_rng(0).standard_normal(500).astype(np.float32), 100, [0, 3, 9, 0, 0]) == [
        ("overload", 100), ("overload-ended", 300),
    ]  # fmt: skip
