"""A sine of 1 kHz on a line and on CAN: in phase to a tenth of a degree, whatever the clocks do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_acquisition import take
from virtual_rig import FilteredSine, served

from drivers.host import open_instruments
from recordings import Run, RunWriter, read_run
from recordings.run import Channel, DeviceSamples, SampleBlock
from recordings.streams import Excitation

RATE_Hz = 25600.0
BETWEEN = 1.0
"""Radians between acc1, on the line, and acc2, on CAN."""


def phase(run: Run, channel: str, frequency_Hz: float = 1000.0) -> float:
    """Of a channel's sine, on the recording's time base, from its last second and a half."""
    device = run.device_of(channel)
    seconds = (device.times_ns() - int(device.block_time_ns[0])) * 1e-9
    late = seconds > seconds[-1] - 1.5
    start_s = (int(device.block_time_ns[0]) - 1_000_000_000) * 1e-9
    turns = 2 * np.pi * frequency_Hz * (seconds[late] + start_s)
    basis = np.stack([np.sin(turns), np.cos(turns)], axis=1)
    a, b = np.linalg.lstsq(basis, device.values[channel][late], rcond=None)[0]
    return float(np.arctan2(b, a))


def degrees_apart(run: Run) -> float:
    apart = phase(run, "acc2") - phase(run, "acc1") - BETWEEN
    return abs(np.rad2deg((apart + np.pi) % (2 * np.pi) - np.pi))


@pytest.mark.parametrize("frames", ["fd", "classic"])
@pytest.mark.parametrize("clock", ["ppm=40,offset_s=3", "ppm=-90,offset_s=-0.2", None])
def test_a_sine_is_in_phase_across_devices(frames, clock, tmp_path):
    faults = [f"clock:device=can,{clock}"] if clock else []
    out = tmp_path / "run.mcap"
    with served(
        FilteredSine(RATE_Hz), serial=True, can_bus=f"unixbus:{tmp_path}/bus", can_frames=frames, faults=faults
    ) as rig:
        settings = rig.on_classic_can() if frames == "classic" else rig.instruments()
        with (
            open_instruments(settings) as acquisition,
            RunWriter(out, info={"source": "simulated"}, channels=acquisition.channels) as writer,
        ):
            acquisition.start()
            acquisition.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=1000.0))
            for block in take(acquisition, 10):
                writer.write_block(block)
            acquisition.stop()
    assert degrees_apart(read_run(out)) < 0.1


@pytest.mark.parametrize("ppm", [30.0, -80.0])
def test_a_node_that_samples_by_its_own_clock_is_in_phase_too(ppm, tmp_path: Path):
    """Blocks of 0.3 s, stamped right at their beginning: without more, 30 ppm would be 3 degrees off at their end."""
    out, length = tmp_path / "run.mcap", 7680
    channels = [Channel(name=name, quantity="acceleration", unit="m/s^2", device=name) for name in ("acc1", "acc2")]
    with RunWriter(out, info={"source": "simulated"}, channels=channels) as writer:
        for first in range(0, 8 * length, length):
            for name, true_Hz, lag in (("acc1", RATE_Hz, 0.0), ("acc2", RATE_Hz * (1 + 1e-6 * ppm), BETWEEN)):
                seconds = (first + np.arange(length)) / true_Hz
                samples = np.sin(2 * np.pi * 1000.0 * seconds + lag).astype(np.float32)
                writer.write_block(
                    SampleBlock(
                        device=name, time_ns=1_000_000_000 + round(seconds[0] * 1e9), first_index=first,
                        sample_rate_Hz=RATE_Hz, samples={name: samples},
                    )
                )  # fmt: skip
    run = read_run(out)
    assert degrees_apart(run) < 0.1
    device = run.devices["acc2"]
    true_ns = 1_000_000_000 + np.arange(len(device)) * 1e9 / (RATE_Hz * (1 + 1e-6 * ppm))
    assert 360e-6 * np.max(np.abs(device.times_ns() - true_ns)) < 0.1


def test_stamps_that_jitter_or_leave_a_hole_are_no_clock():
    stamps = np.array([0, 300_400_000, 1_600_000_000])  # a millisecond in a third of a second; a second more
    device = DeviceSamples(
        device="daq", sample_rate_Hz=RATE_Hz, values={"acc1": np.zeros(3 * 7680, np.float32)},
        block_start=np.array([0, 7680, 15360]), block_time_ns=stamps, overload={},
    )  # fmt: skip
    spacing_ns = np.diff(device.times_ns())
    assert set(spacing_ns[:7000]) <= {39062, 39063}
    assert set(spacing_ns[7680:15000]) <= {39062, 39063}
