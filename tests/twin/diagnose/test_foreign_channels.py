"""Channels that the rig does not have, or that were announced and never recorded, say nothing about it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from recordings.run import Channel, DeviceSamples, Run
from twin.diagnose.sound_data import sound_data
from twin.identify.rig_channels import own_channels
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


def with_meters(run: Run) -> Run:
    """A room's constant temperature at ten samples a second, and a clipped voltage beside the accelerometers."""
    clock = next(iter(run.devices.values()))
    count = len(next(iter(clock.values.values())))
    slow = int(count * 10 / clock.sample_rate_Hz)
    voltage = np.clip(np.sin(np.arange(count)), -0.5, 0.5).astype(np.float32)
    meter = DeviceSamples(
        device="meter", sample_rate_Hz=10.0, values={"room": np.full(slow, 21.0, np.float32)},
        block_start=np.array([0]), block_time_ns=clock.block_time_ns[:1], overload={},
    )  # fmt: skip
    channels = {
        "room": Channel(name="room", quantity="temperature", unit="degC", device="meter"),
        "drive": Channel(name="drive", quantity="voltage", unit="V", device=clock.device),
        "unplugged": Channel(name="unplugged", quantity="acceleration", unit="m/s^2", device=clock.device),
    }
    daq = replace(clock, values={**clock.values, "drive": voltage})
    return replace(
        run, channels={**channels, **run.channels}, devices={**run.devices, clock.device: daq, "meter": meter}
    )


@pytest.mark.slow
def test_other_channels_are_neither_blamed_nor_in_the_way(campaign: Path) -> None:
    run = with_meters(read_run(campaign / "sweeps.mcap"))
    found = sound_data([run], RIG)
    plain = sound_data([read_run(campaign / "sweeps.mcap")], RIG)
    assert [finding.names for finding in found.findings] == [finding.names for finding in plain.findings]
    assert found.evidence.channels == plain.evidence.channels
    np.testing.assert_array_equal(found.evidence.steps.response, plain.evidence.steps.response)


def test_a_sensor_of_the_rig_without_samples_is_not_used_and_told(campaign: Path) -> None:
    run = read_run(campaign / "sweeps.mcap")
    devices = {
        name: replace(device, values={n: x for n, x in device.values.items() if n != "acc1"})
        for name, device in run.devices.items()
    }
    evidence = sound_data([replace(run, devices=devices)], RIG).evidence
    assert "acc1" not in evidence.channels
    assert evidence.unused_told == ("the rig's acc1 was not used: not all recordings have samples of it",)


def test_the_rigs_own_channels_are_kept_as_they_are(campaign: Path) -> None:
    run = read_run(campaign / "sweeps.mcap")
    assert own_channels(run, RIG).channels == run.channels
