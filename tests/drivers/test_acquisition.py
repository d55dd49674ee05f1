"""Host drivers against virtual instruments: every sample, once, in order, or an event that says why not."""

import time
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from virtual_rig import PATIENCE_S, FilteredSine, served, wait_until

from drivers.host import RigAcquisition, open_instruments
from drivers.virtual.server import PACED_BLOCK_S
from recordings.run import SampleBlock
from recordings.streams import Excitation

SINE = Excitation(kind="sine", amplitude_V=0.5, frequency_Hz=27.0)


def take(acquisition: RigAcquisition, reads: int, *, timeout_s: float = PATIENCE_S) -> list[SampleBlock]:
    return [block for _ in range(reads) for block in acquisition.read(timeout_s=timeout_s)]


def take_into(blocks: list[SampleBlock], acquisition: RigAcquisition, *, until: str) -> None:
    """Until it fails for that reason; a busy machine may be late without any."""
    give_up = time.monotonic() + PATIENCE_S
    while True:
        try:
            blocks += acquisition.read(timeout_s=1.5)
        except TimeoutError as error:
            if until in str(error) or time.monotonic() > give_up:
                raise


def channel(blocks: list[SampleBlock], name: str) -> np.ndarray:
    return np.concatenate([block.samples[name] for block in blocks if name in block.samples])


def quantised(values: np.ndarray, limit: float) -> np.ndarray:
    return np.rint(values * (32767 / limit)).astype(np.float32) * np.float32(limit / 32767)


@pytest.fixture(params=["serial", "tcp"])
def line(request):
    return {request.param: True}


@pytest.fixture(params=["unixbus", "virtual", "udp_multicast", "slcan"])
def bus(request, tmp_path):
    if request.param == "udp_multicast":
        request.getfixturevalue("multicast_alone")
    channel = {
        "unixbus": f"{tmp_path}/bus",
        "virtual": "rig",
        "udp_multicast": "239.74.163.7",
        "slcan": f"{tmp_path}/adapter",
    }[request.param]
    return f"{request.param}:{channel}"


def test_over_a_line_alone_samples_are_bit_for_bit(line):
    with served(FilteredSine(), **line) as rig, open_instruments(rig.instruments()) as acquisition:
        assert acquisition.set_sample_rate(5000.0) == 5120.0
        acquisition.start()
        acquisition.set_output(SINE)
        blocks = take(acquisition, 12)
        acquisition.stop()
        assert not acquisition.take_events()
    for k, name in enumerate(("force", "acc1", "acc2")):
        values = channel(blocks, name)
        assert np.array_equal(values, rig.source.everything[k, : len(values)])


def test_line_and_can_are_one_acquisition(line, bus):
    with served(FilteredSine(), can_bus=bus, **line) as rig, open_instruments(rig.instruments()) as acquisition:
        assert [c.name for c in acquisition.channels] == ["force", "acc1", "acc2"]
        acquisition.set_sample_rate(1024.0)
        acquisition.start()
        holds_ns = acquisition.set_output(SINE)
        blocks = take(acquisition, 20)
        acquisition.stop()
        assert not acquisition.take_events()
    by_device = {name: [b for b in blocks if b.device == name] for name in ("daq", "can")}
    for daq, can in zip(by_device["daq"], by_device["can"], strict=True):
        assert (daq.first_index, daq.time_ns, len(daq)) == (can.first_index, can.time_ns, len(can))
    sent = rig.source.everything
    assert np.array_equal(channel(blocks, "acc1"), sent[1, : 20 * 240])
    assert np.array_equal(channel(blocks, "acc2"), quantised(sent[2, : 20 * 240], 490.0))
    assert holds_ns == round(rig.source.changes[0] * 1e9 / 1024)


def test_a_run_as_fast_as_possible_repeats_sample_by_sample(tmp_path):
    """Whatever the processes' scheduling: outputs change at the end of the window, not when the command arrives."""
    runs = []
    for attempt in range(2):
        with (
            served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus{attempt}") as rig,
            open_instruments(rig.instruments()) as acquisition,
        ):
            acquisition.start()
            blocks = []
            for step in range(6):
                time.sleep(0.02 * attempt * (step % 3))
                acquisition.set_output(Excitation(kind="sine", amplitude_V=0.1 * step, frequency_Hz=20.0 + step))
                blocks += take(acquisition, 3)
            acquisition.stop()
            runs.append((rig.source.changes[:6], channel(blocks, "force")))
    assert runs[0][0] == runs[1][0]
    assert np.array_equal(runs[0][1], runs[1][1])


def test_it_can_be_started_again_with_another_rate(tmp_path):
    with (
        served(FilteredSine(), tcp=True, can_bus=f"unixbus:{tmp_path}/bus") as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        for rate in (512.0, 5120.0):
            assert acquisition.set_sample_rate(rate) == rate
            acquisition.start()
            blocks = take(acquisition, 3)
            acquisition.stop()
            acquisition.stop()
            assert {block.sample_rate_Hz for block in blocks} == {rate}
            assert blocks[0].first_index == 0
        assert not acquisition.take_events()


def test_a_setting_that_the_instrument_refuses_is_an_error_with_its_reason(line):
    from recordings.errors import InputError

    with served(FilteredSine(), **line) as rig, open_instruments(rig.instruments()) as acquisition:
        acquisition.start()
        with pytest.raises(InputError, match=r"-222.*Data out of range"):
            acquisition.set_output(Excitation(kind="sine", amplitude_V=11.0, frequency_Hz=10.0))
        acquisition.set_output(SINE)
        assert take(acquisition, 2)


def test_in_real_time_a_second_takes_a_second():
    """Not less; more wherever the machine does something else, which `twin speed` measures."""
    with served(FilteredSine(), serial=True, speed=4.0) as rig, open_instruments(rig.instruments()) as acquisition:
        began = time.monotonic()
        acquisition.start()
        blocks = take(acquisition, 8)
        elapsed = time.monotonic() - began
    seconds = sum(len(block) for block in blocks) / 1024
    assert elapsed > seconds / 4 - PACED_BLOCK_S  # the first piece is there at once


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("drop:device=daq,probability=0.2", "lost-samples"),
        ("drop:device=daq,probability=0.2", "lost-frames"),
        ("flip:device=daq,probability=0.2", "checksum"),
        ("flip:device=daq,probability=0.2", "lost-samples"),
        ("duplicate:device=daq,probability=0.2", "duplicate"),
        ("drop:device=can,probability=0.05", "lost-samples"),
        ("duplicate:device=can,probability=0.05", "duplicate"),
        ("stuck:channel=acc1,at_s=2", "stuck"),
        ("overload:channel=acc1,at_s=2,factor=1e6", "overload"),
        ("overload:channel=acc2,at_s=2,factor=1e6", "overload"),
    ],
)
def test_faults_become_events_and_never_wrong_numbers(fault, kind, tmp_path):
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=[fault]) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        acquisition.set_output(SINE)
        blocks = take(acquisition, 25)
        acquisition.stop()
        events = Counter(event.kind for event in acquisition.take_events())
    assert events[kind] >= 1
    if fault.startswith(("stuck", "overload")):
        return
    sent = rig.source.everything
    for block in blocks:
        part = slice(block.first_index, block.first_index + len(block))
        for name, values in block.samples.items():
            k = ("force", "acc1", "acc2").index(name)
            truth = quantised(sent[k, part], 490.0) if name == "acc2" else sent[k, part]
            assert np.array_equal(values, truth)


@pytest.mark.parametrize("speed", [None, 200.0])
def test_samples_on_the_limit_are_counted_in_the_block_they_are_in(speed, tmp_path):
    """Also where several blocks wait to be read, and the frames of an instrument in real time are cut otherwise."""
    faults = ["overload:channel=acc1,at_s=1,seconds=1.5,factor=1e6", "overload:channel=acc2,at_s=1,factor=1e6"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", speed=speed, faults=faults) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        acquisition.set_output(SINE)
        wait_until(lambda: rig.source.index >= 480)  # two blocks, as many as a client may be behind
        blocks = take(acquisition, 20)
        acquisition.stop()
    for name in ("acc1", "acc2"):
        mine = [block for block in blocks if name in block.samples]
        counts = [block.overload.get(name, 0) for block in mine]
        assert counts == [int(np.count_nonzero(abs(block.samples[name]) >= np.float32(490.0))) for block in mine]
        assert max(counts) > 0


@pytest.mark.parametrize("device", ["daq", "can"])
def test_reordered_frames_are_put_back(device, tmp_path):
    faults = [f"reorder:device={device},probability=0.2"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks = take(acquisition, 25)
        acquisition.stop()
        kinds = {event.kind for event in acquisition.take_events()}
    assert "lost-samples" not in kinds
    assert "reordered" in kinds
    assert np.array_equal(channel(blocks, "acc1"), rig.source.everything[1, : 25 * 240])
    assert np.array_equal(channel(blocks, "acc2"), quantised(rig.source.everything[2, : 25 * 240], 490.0))


def test_lost_samples_are_counted_exactly(tmp_path):
    faults = ["drop:device=daq,probability=0.3"]
    with served(FilteredSine(), serial=True, faults=faults) as rig, open_instruments(rig.instruments()) as acquisition:
        acquisition.start()
        blocks = take(acquisition, 20)
        acquisition.stop()
        lost = [e for e in acquisition.take_events() if e.kind == "lost-samples"]
    counted = sum(int(event.detail.split()[0]) for event in lost)
    missing = sum(b.first_index - a.first_index - len(a) for a, b in pairwise(blocks))
    assert counted == missing + blocks[0].first_index > 0


def test_a_slow_client_in_real_time_costs_samples_and_the_instrument_says_how_many():
    with served(FilteredSine(rate_Hz=25600.0), serial=True, speed=100.0) as rig:
        acquisition = open_instruments(rig.instruments())
        acquisition.start()
        take(acquisition, 2)
        began = rig.source.index
        with acquisition._mailbox.changed:  # the reader cannot put anything away: a host that is busy
            wait_until(lambda: rig.source.index > began + 1_000_000)
        events = []

        def read() -> None:
            acquisition.read(timeout_s=PATIENCE_S)
            events.extend(acquisition.take_events())

        wait_until(lambda: {"overrun", "lost-samples"} <= {e.kind for e in events}, step=read)
        acquisition.close()
        events += acquisition.take_events()
    kinds = {event.kind for event in events}
    assert {"overrun", "lost-samples"} <= kinds


@pytest.mark.parametrize("kind", ["serial", "tcp"])
def test_a_line_that_is_cut_is_found_again_and_the_stream_goes_on(kind, tmp_path):
    options = {"serial": True, "link": tmp_path / "line"} if kind == "serial" else {"tcp": True}
    with (
        served(FilteredSine(), faults=["disconnect:device=daq,at_s=3"], **options) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        acquisition.set_output(SINE)
        blocks = take(acquisition, 40)
        acquisition.stop()
        events = list(acquisition.take_events())
    kinds = [event.kind for event in events]
    assert "disconnected" in kinds
    assert "reconnected" in kinds
    sent = rig.source.everything
    for block in blocks:
        part = slice(block.first_index, block.first_index + len(block))
        assert np.array_equal(block.samples["force"], sent[0, part])
    end = blocks[-1].first_index + len(blocks[-1])
    lost = sum(int(event.detail.split()[0]) for event in events if event.kind == "lost-samples")
    assert sum(map(len, blocks)) + lost == end


def test_an_instrument_that_has_gone_is_an_error_in_time(tmp_path):
    with served(FilteredSine(), tcp=True) as rig:
        acquisition = open_instruments(rig.instruments(reconnect_s=0.5, timeout_s=3.0))
        acquisition.start()
        take(acquisition, 2)
    with pytest.raises(TimeoutError, match="disconnected"):
        take(acquisition, 100, timeout_s=1.0)
    assert "disconnected" in {event.kind for event in acquisition.take_events()}
    acquisition.close()


def test_clocks_that_differ_are_brought_together(tmp_path):
    faults = ["clock:device=can,ppm=40,offset_s=3"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks = take(acquisition, 60)
        acquisition.stop()
        (told,) = acquisition.take_events()
    assert (told.source, told.kind) == ("can", "clock")
    assert told.detail.startswith("was 3.00")
    assert "40.00 ppm fast" in told.detail
    times = {name: {b.first_index: b.time_ns for b in blocks if b.device == name} for name in ("daq", "can")}
    late = [abs(times["can"][i] - times["daq"][i]) for i in sorted(times["daq"])][4:]
    assert 360 * 1000 * 1e-9 * max(late) < 0.1  # degrees at 1 kHz


def test_a_stall_shorter_than_the_patience_costs_nothing():
    faults = ["stall:device=daq,at_s=1,seconds=0.6"]
    with served(FilteredSine(), serial=True, faults=faults) as rig, open_instruments(rig.instruments()) as acquisition:
        acquisition.start()
        blocks = take(acquisition, 10)
        acquisition.stop()
        assert not acquisition.take_events()
    assert np.array_equal(channel(blocks, "force"), rig.source.everything[0, : 10 * 240])


@pytest.mark.parametrize("kind", ["serial", "tcp"])
def test_an_instrument_that_loses_its_power_is_told_and_what_came_before_is_right(kind, tmp_path):
    options = {"serial": True, "link": tmp_path / "line"} if kind == "serial" else {"tcp": True}
    with (
        served(FilteredSine(), faults=["restart:device=daq,at_s=3"], **options) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks: list[SampleBlock] = []
        with pytest.raises(TimeoutError, match="restarted"):
            take_into(blocks, acquisition, until="restarted")
        acquisition.stop()
        kinds = {event.kind for event in acquisition.take_events()}
    assert {"disconnected", "device-restart"} <= kinds
    force = channel(blocks, "force")
    assert len(force) >= 2048
    assert np.array_equal(force, rig.source.everything[0, : len(force)])


def test_a_node_that_is_unplugged_for_a_while_goes_on_and_nothing_is_lost(tmp_path):
    faults = ["disconnect:device=can,at_s=2,seconds=0.6"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults) as rig,
        open_instruments(rig.instruments()) as acquisition,
    ):
        acquisition.start()
        blocks = take(acquisition, 30)
        acquisition.stop()
    tip = channel([b for b in blocks if b.device == "can"], "acc2")
    assert np.array_equal(tip, quantised(rig.source.everything[2, : len(tip)], 490.0))
    assert len(tip) == 30 * 240


def test_a_node_that_loses_its_power_is_noticed_and_the_others_go_on(tmp_path):
    faults = ["restart:device=can,at_s=4"]
    with (
        served(FilteredSine(), serial=True, can_bus=f"unixbus:{tmp_path}/bus", faults=faults, speed=10.0) as rig,
        open_instruments(rig.instruments(silence_s=2.0)) as acquisition,
    ):
        acquisition.start()
        blocks = take(acquisition, 12)
        events: list = []

        def read() -> None:
            blocks.extend(acquisition.read(timeout_s=PATIENCE_S))
            events.extend(acquisition.take_events())

        wait_until(lambda: any(e.kind == "device-restart" for e in events), step=read)
        acquisition.stop()
        events += acquisition.take_events()
    kinds = {event.kind for event in events}
    assert {"silent", "device-restart", "lost-samples"} <= kinds
    force = channel([b for b in blocks if b.device == "daq"], "force")
    assert np.array_equal(force, rig.source.everything[0, : len(force)])
    tip = channel([b for b in blocks if b.device == "can"], "acc2")
    assert np.array_equal(tip, quantised(rig.source.everything[2, : len(tip)], 490.0))
    assert len(tip) < len(force)
