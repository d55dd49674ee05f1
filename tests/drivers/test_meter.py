"""The slow meter: to a stranger an SCPI instrument, to the host a source of indicators that never holds it up."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pytest
import pyvisa
from virtual_rig import PATIENCE_S, VISA_OPTIONS, FilteredSine, SlowRoom, served, wait_until

from drivers.host import RigAcquisition, open_instruments
from recordings.errors import InputError
from recordings.run import Indicator, SampleBlock


@pytest.mark.parametrize("where", ["auto", "127.0.0.1:0"])
def test_pyvisa_reads_it(where):
    with served(FilteredSine(), tcp=True, meter=where) as rig:
        kind, _, address = str(rig.meter).partition(":")
        manager = pyvisa.ResourceManager("@py")
        name = f"ASRL{address}::INSTR" if kind == "serial" else "TCPIP::{}::{}::SOCKET".format(*address.split(":"))
        meter = manager.open_resource(name, **VISA_OPTIONS)
        assert meter.query("*IDN?") == "Virtual Test Rig,METER,simulated,1.0"
        assert meter.query("CHAN:CAT?") == '"preload","temperature"'
        step = 1000.0 / 2**15
        preload = float(meter.query("MEASURE:PRELOAD?"))
        assert preload == pytest.approx(540.0, abs=4 * step)
        assert preload / step == pytest.approx(round(preload / step), abs=1e-6)  # it has a converter
        assert float(meter.query("meas:temp?")) == pytest.approx(20.0, abs=0.02)
        assert float(meter.query("READ?").partition(",")[0]) == preload  # the same 100 ms
        meter.write("*CLS")
        meter.write("MEAS:CHAN? 3")
        assert meter.query("SYST:ERR?").startswith("-222")
        meter.close()
        manager.close()


def read_with_the_meter(acquisition: RigAcquisition, reads: int) -> tuple[Sequence[SampleBlock], list[Indicator]]:
    """The last blocks and all that the meter told, at a pace that it keeps up with: one value about every 1.2 s."""
    indicators: list[Indicator] = []

    def listen() -> None:
        time.sleep(0.002)
        indicators.extend(acquisition.take_indicators())

    for _ in range(reads):
        blocks = acquisition.read(timeout_s=PATIENCE_S)
        due = 1 + int(blocks[0].time_ns * 1e-9 / 1.2)
        wait_until(lambda due=due: sum(each.name == "preload" for each in indicators) >= due, step=listen)
    return blocks, indicators


@pytest.mark.parametrize("where", ["auto", "127.0.0.1:0"])
def test_its_values_come_with_the_samples_about_once_a_second(where):
    with served(FilteredSine(), serial=True, meter=where) as rig, open_instruments(rig.instruments()) as acquisition:
        assert [channel.name for channel in acquisition.channels] == ["force", "acc1", "acc2"]
        assert acquisition.meter_values["preload"] == (pytest.approx(540.0, abs=0.2), "preload")
        acquisition.start()
        blocks, indicators = read_with_the_meter(acquisition, 60)
        acquisition.stop()
        assert not acquisition.take_events()
    end_s = blocks[0].time_ns * 1e-9
    preload = [each for each in indicators if each.name == "preload"]
    assert 0.7 * end_s <= len(preload) <= end_s + 1
    for each in preload:
        assert each.unit == "N"
        assert each.value == pytest.approx(540.0 - 2.0 * each.time_ns * 1e-9, abs=2.0)  # asked within a second
    times = np.array([each.time_ns for each in preload]) * 1e-9
    values = np.array([each.value for each in preload])
    assert np.polyfit(times, values, 1)[0] == pytest.approx(-2.0, abs=0.1)
    assert Counter(each.name for each in indicators)["temperature"] == len(preload)


def test_without_it_a_run_goes_on_and_says_so_and_it_is_found_again(tmp_path):
    faults = ["disconnect:device=meter,at_s=2"]
    with (
        served(FilteredSine(), tcp=True, meter="127.0.0.1:0", faults=faults, speed=10.0) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        samples, events, indicators = 0, [], []
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline and "reconnected" not in {event.kind for event in events}:
            blocks = acquisition.read(timeout_s=PATIENCE_S)
            samples += sum(len(block) for block in blocks if block.device == "daq")
            events += acquisition.take_events()
            indicators += acquisition.take_indicators()
        late = []
        while not late and time.monotonic() < deadline:
            acquisition.read(timeout_s=PATIENCE_S)
            late += acquisition.take_indicators()
        acquisition.stop()
    assert [(event.source, event.kind) for event in events] == [("meter", "disconnected"), ("meter", "reconnected")]
    assert indicators
    assert late[-1].time_ns > indicators[0].time_ns
    assert samples > 2 * 1024


def test_a_meter_that_falls_silent_costs_the_samples_nothing(tmp_path):
    faults = ["stall:device=meter,at_s=1,seconds=1000"]
    with (
        served(FilteredSine(), tcp=True, meter="auto", faults=faults) as rig,
        open_instruments(rig.instruments(timeout_s=1.0)) as acquisition,
    ):
        acquisition.start()
        for _ in range(40):  # were the meter waited for, they would not come
            acquisition.read(timeout_s=PATIENCE_S)
        acquisition.stop()
        assert {event.kind for event in acquisition.take_events()} <= {"disconnected"}


def test_a_value_beyond_the_range_is_an_event_and_no_number():
    class Hot(SlowRoom):
        def read(self, time_s: float) -> list[float]:
            return [540.0, 20.0 if time_s < 1.0 else 500.0]

    with (
        served(FilteredSine(), tcp=True, meter="auto", slow=Hot()) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        _, indicators = read_with_the_meter(acquisition, 40)
        acquisition.stop()
        events = [(event.source, event.kind) for event in acquisition.take_events()]
    assert events == [("temperature", "overload")]
    assert max(each.value for each in indicators if each.name == "temperature") < 21
    assert len([each for each in indicators if each.name == "preload"]) > 5


def test_what_is_no_meter_is_refused_in_words():
    with served(FilteredSine(), tcp=True) as rig:
        instruments = rig.instruments().model_dump(mode="json")
        instruments["device"].append({"name": "meter", "address": "tcp:127.0.0.1:9", "kind": "meter"})
        with pytest.raises(InputError, match="nothing listens there"):
            open_instruments(type(rig.instruments()).model_validate(instruments))
