"""Channels with the samples of another one, found in one pass over all of them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import recordings.run
import twin.checks.same_run
from recordings.run import Channel, DeviceSamples, Run
from twin.checks.same_run import look_at_copies


def of(values: dict[str, np.ndarray]) -> Run:
    """Two devices' channels."""
    devices = {}
    for device, names in (("daq", [n for n in values if n < "m"]), ("node", [n for n in values if n >= "m"])):
        devices[device] = DeviceSamples(
            device=device, sample_rate_Hz=1.0, values={name: values[name] for name in names},
            block_start=np.zeros(1, np.int64), block_time_ns=np.zeros(1, np.int64), overload={},
        )  # fmt: skip
    channels = {name: Channel(name=name, quantity="force", unit="N") for name in values}
    return Run(path="run", info={}, channels=channels, devices=devices, steps=(), events=())


@pytest.mark.parametrize("piece", [7, 1000])
def test_they_are_those_that_are_equal_pair_by_pair(monkeypatch: pytest.MonkeyPatch, piece: int) -> None:
    for module in (recordings.run, twin.checks.same_run):
        monkeypatch.setattr(module, "PIECE", piece)
    rng = np.random.default_rng(0)
    one, two = rng.integers(-1, 2, (2, 50)).astype(np.float32)
    late, lost = one.copy(), one.copy()
    late[-1] += 1
    lost[30] = np.nan
    values = {
        "a": one, "b": two, "c": one.astype(float), "d": -(-one * 1), "e": late, "f": lost, "g": lost, "h": one[:49],
        "still": np.zeros(50, np.float32), "still-too": -np.zeros(50, np.float32), "steps": np.repeat(one[:5], 10),
        "n": two, "o": np.where(one == 0, np.float32(-0.0), one), "p": np.repeat(one[:5], 10),
        "none": np.zeros(0, np.float32), "nothing": np.zeros(0, np.float32),
    }  # fmt: skip
    equal = {
        (x, y) for x, y in combinations(values, 2) if np.array_equal(values[x], values[y]) and len(set(values[x])) > 1
    }
    assert len(equal) == 8
    found = [
        (finding.found.removeprefix("its samples are those of "), finding.channel)
        for finding in look_at_copies(of(values))
    ]
    assert len(found) == len(equal)
    assert set(map(frozenset, found)) == set(map(frozenset, equal))
