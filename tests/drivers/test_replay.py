"""A recorded run behind the instruments: the same samples over every line, and what was lost is lost again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import pyvisa
from test_acquisition import channel, quantised
from virtual_rig import CHANNELS, PATIENCE_S, VISA_OPTIONS, served

from drivers.host import StreamEndedError, open_instruments
from drivers.virtual import RecordedMeter, RecordedSource
from recordings.errors import InputError
from recordings.run import DeviceSamples, Event, Indicator, Run, SampleBlock

RATE_Hz, LENGTH = 1024.0, 2000
STEP = np.float32(490.0 / 32767)


def recorded(spoil: Callable[[dict[str, np.ndarray]], None] = lambda values: None, **changes: object) -> Run:
    """A run of two devices: force and acc1 in float32 from a line, acc2 in the counts of a CAN node."""
    generator = np.random.default_rng(8)
    values = {name: generator.standard_normal(LENGTH).astype(np.float32) for name in ("force", "acc1")}
    counts = generator.integers(-32766, 32767, LENGTH).astype(np.int16)
    values["acc2"] = counts.astype(np.float32) * STEP
    spoil(values)
    devices = {
        name: DeviceSamples(
            device=name, sample_rate_Hz=RATE_Hz, values={each: values[each] for each in channels},
            block_start=np.array([0]), block_time_ns=np.array([1_000_000_000]), overload={},
        )
        for name, channels in (("daq", ("force", "acc1")), ("can", ("acc2",)))
    }  # fmt: skip
    return Run(
        path="run.mcap", info={}, channels={each.name: each for each in CHANNELS}, devices={**devices, **changes},
        steps=(), events=(),
        indicators=tuple(
            Indicator(name=name, time_ns=round(1e9 * second), value=value + second / 3, unit=unit)
            for second in (1.0, 2.0, 2.5)
            for name, value, unit in (("preload", 540.0, "N"), ("room", 20.0, "degC"))
        ),
    )  # fmt: skip


def acquire(run: Run, **lines: object) -> tuple[list[SampleBlock], list[Event], list[Indicator]]:
    blocks: list[SampleBlock] = []
    indicators: list[Indicator] = []
    slow = RecordedMeter(run) if "meter" in lines else None
    with (
        served(RecordedSource(run), slow=slow, **lines) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        try:
            while True:
                blocks += acquisition.read(timeout_s=PATIENCE_S)
                indicators += acquisition.take_indicators()
        except StreamEndedError:
            pass
        acquisition.stop()
        return blocks, list(acquisition.take_events()), indicators


def bits(values: np.ndarray) -> np.ndarray:
    return values.view(np.uint32)


@pytest.mark.parametrize("line", ["serial", "tcp"])
@pytest.mark.parametrize("interface", ["virtual", "udp_multicast", "slcan", "unixbus"])
def test_every_sample_comes_again_bit_for_bit(line, interface, request, tmp_path):
    """Also over CAN, whose 16 bits are those that a CAN node has recorded."""
    if interface == "udp_multicast":
        request.getfixturevalue("multicast_alone")
    where = {"virtual": "again", "udp_multicast": "239.74.163.12"}.get(interface, f"{tmp_path}/bus")
    run = recorded()
    blocks, events, _ = acquire(run, can_bus=f"{interface}:{where}", **{line: True})
    assert not events
    for device in run.devices.values():
        for name, values in device.values.items():
            assert np.array_equal(bits(channel(blocks, name)), bits(values))
    assert {block.time_ns for block in blocks if block.first_index == 0} == {1_000_000_000}


def lose(values: dict[str, np.ndarray]) -> None:
    values["force"][500:777] = values["acc1"][500:777] = np.nan
    values["acc2"][1001:1100] = np.nan


def test_what_a_recording_lost_is_lost_again_and_never_a_number(tmp_path):
    run = recorded(lose)
    blocks, events, _ = acquire(run, serial=True, can_bus=f"unixbus:{tmp_path}/bus")
    lost = {event.source: event.detail for event in events if event.kind == "lost-samples"}
    assert lost == {"daq": "277 samples, 500 to 776", "can": "99 samples, 1001 to 1099"}
    for name, device in (("force", "daq"), ("acc1", "daq"), ("acc2", "can")):
        came = np.full(LENGTH, np.nan, np.float32)
        for block in blocks:
            if name in block.samples:
                came[block.first_index : block.first_index + len(block)] = block.samples[name]
        assert np.array_equal(bits(came), bits(run.devices[device].values[name]))


def test_a_sample_on_the_limit_is_so_again():
    def clip(values: dict[str, np.ndarray]) -> None:
        values["acc2"][700:703] = np.float32(32767) * STEP  # a rounding below 490

    _, events, _ = acquire(recorded(clip), tcp=True)
    assert [(event.source, event.detail[:4]) for event in events if event.kind == "overload"] == [("acc2", "3 of")]


def test_floats_on_a_can_node_are_rounded_to_its_steps(tmp_path):
    run = recorded()
    blocks, _, _ = acquire(run, tcp=True, can_bus="virtual:rounded", can_channels=("acc1", "acc2"))
    assert np.array_equal(channel(blocks, "acc1"), quantised(run.devices["daq"].values["acc1"], 490.0))


@pytest.mark.parametrize("where", ["auto", "127.0.0.1:0"])
def test_a_meters_values_come_again(where):
    run = recorded()
    told = {(each.name, each.value, each.unit) for each in run.indicators}
    with served(RecordedSource(run), tcp=True, meter=where, slow=RecordedMeter(run)) as rig:
        kind, _, address = str(rig.meter).partition(":")
        manager = pyvisa.ResourceManager("@py")
        name = f"ASRL{address}::INSTR" if kind == "serial" else "TCPIP::{}::{}::SOCKET".format(*address.split(":"))
        with manager.open_resource(name, **VISA_OPTIONS) as meter:
            assert float(meter.query("MEAS:PREL?")) == 540.0 + 1.0 / 3
            assert float(meter.query("MEAS:TEMP?")) == 20.0 + 1.0 / 3
        manager.close()
    _, events, indicators = acquire(run, tcp=True, meter=where)
    assert not events
    assert {(each.name, each.value, each.unit) for each in indicators} <= told
    assert {each.name for each in indicators} == {"preload", "room"}


def test_between_two_readings_the_earlier_one_holds():
    meter = RecordedMeter(recorded())
    for second, latest in ((0.0, 1.0), (1.99, 1.0), (2.0, 2.0), (2.4, 2.0), (9.0, 2.5)):
        assert meter.read(second) == [540.0 + latest / 3, 20.0 + latest / 3]


def test_a_device_whose_clock_left_the_others_is_named():
    slow_clock = DeviceSamples(
        device="can", sample_rate_Hz=RATE_Hz, values={"acc2": np.zeros(LENGTH, np.float32)},
        block_start=np.array([0, 1000]), block_time_ns=np.array([1_000_000_000, 1_980_000_000]), overload={},
    )  # fmt: skip
    assert RecordedSource(recorded()).slips == {}
    # 1000 samples took 0.98 s and not 0.9766 s: 3.52 samples too few came by then
    assert RecordedSource(recorded(can=slow_clock)).slips == {"can": pytest.approx(-3.52, abs=0.01)}


@pytest.mark.parametrize("name", ["drive (N)", "beschl ä1", "a" * 25])
def test_a_channel_that_no_line_can_name_is_refused(name):
    """Before anything is served: a client would only see that a device announces it."""
    odd = DeviceSamples(
        device="can", sample_rate_Hz=RATE_Hz, values={name: np.zeros(LENGTH, np.float32)},
        block_start=np.array([0]), block_time_ns=np.array([1_000_000_000]), overload={},
    )  # fmt: skip
    with pytest.raises(InputError, match="instrument's line"):
        RecordedSource(recorded(can=odd))
