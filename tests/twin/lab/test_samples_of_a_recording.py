"""A recording's samples by channel, with their times, and as other people's frames hold them."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from needed import package

from recordings import Channel, DeviceSamples, InputError, Run
from twin.lab import Recording

RATE_Hz = {"daq": 100.0, "can": 50.0}
OF = {"force": "daq", "acc1": "daq", "acc2": "can"}


def device(name: str, *, begun_ns: int, **values: np.ndarray) -> DeviceSamples:
    return DeviceSamples(
        device=name, sample_rate_Hz=RATE_Hz[name], values=values, block_start=np.array([0]),
        block_time_ns=np.array([begun_ns]), overload={},
    )  # fmt: skip


@pytest.fixture
def two_clocks() -> Recording:
    """Ten samples of two channels, and four at half the rate, 10 ms later, of which one was lost."""
    slow = np.array([0.0, np.nan, 2.0, 3.0], np.float32)
    fast = np.arange(10, dtype=np.float32)
    devices = {
        "daq": device("daq", begun_ns=5_000_000_000, force=fast, acc1=-fast),
        "can": device("can", begun_ns=5_010_000_000, acc2=slow),
    }
    channels = {
        name: Channel(name=name, quantity="force" if name == "force" else "acceleration", unit="N", device=of)
        for name, of in OF.items()
    }
    return Recording(Run(path="run.mcap", info={"rig": "r"}, channels=channels, devices=devices, steps=(), events=()))


@pytest.fixture
def one_clock(two_clocks: Recording) -> Recording:
    return Recording(replace(two_clocks.run, devices={"daq": two_clocks.run.devices["daq"]}))


def test_samples_and_their_times_by_channel(one_clock: Recording) -> None:
    assert list(one_clock) == ["force", "acc1"]
    assert "acc2" not in one_clock
    np.testing.assert_array_equal(one_clock["acc1"], -np.arange(10.0))
    np.testing.assert_allclose(one_clock.time, 0.01 * np.arange(10), rtol=0, atol=1e-9)
    with pytest.raises(KeyError, match="acc2"):
        one_clock["acc2"]


def test_devices_have_their_own_times(two_clocks: Recording) -> None:
    with pytest.raises(ValueError, match=r"daq, can: ask for time_of"):
        two_clocks.time  # noqa: B018
    np.testing.assert_allclose(two_clocks.time_of("acc2"), 0.01 + 0.02 * np.arange(4), rtol=0, atol=1e-9)


def test_a_data_frame_holds_every_sample_at_its_time(two_clocks: Recording) -> None:
    package("pandas", "frames")
    frame = two_clocks.to_pandas()
    assert list(frame.columns) == ["force", "acc1", "acc2"]
    assert frame.index.name == "time, s"
    assert len(frame) == 10
    np.testing.assert_array_equal(frame["force"], np.arange(10.0))
    np.testing.assert_array_equal(frame["acc2"].dropna(), [0, 2, 3])


def test_a_data_set_says_quantities_and_keeps_clocks_apart(two_clocks: Recording, one_clock: Recording) -> None:
    package("xarray", "frames")
    data = two_clocks.to_xarray()
    assert dict(data.sizes) == {"time_daq": 10, "time_can": 4}
    assert data["acc2"].attrs["quantity"] == "acceleration"
    assert data.attrs == {"rig": "r"}
    np.testing.assert_allclose(data["time_can"], two_clocks.time_of("acc2"))
    assert dict(one_clock.to_xarray().sizes) == {"time": 10}


def test_a_missing_package_is_named_with_its_extra(one_clock: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(InputError, match=r"needs xarray, which is not installed; .*\[frames\]"):
        one_clock.to_xarray()
