"""The node on classic CAN: its messages in pieces of 8 bytes, its samples decimated as far as the bus needs it."""

from __future__ import annotations

import time
from dataclasses import replace

import can
import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_acquisition import channel, quantised, take
from virtual_rig import CHANNELS, PATIENCE_S, FilteredSine, served

from drivers.can_dialect import ClassicDialect, Message, unwrap
from drivers.can_protocol import NO_PULSE, CanCommand, ChannelInfo, Heartbeat, Reply, Status, TimeSync, read_dbc
from drivers.host import open_instruments
from drivers.virtual.bus_time import classic_frame_seconds
from drivers.virtual.decimation import HALF_LENGTH, Decimator
from recordings.streams import Excitation

DATABASE = cantools.database.load_string(read_dbc(), "dbc")


def through(message: Message, dialect: ClassicDialect | None = None) -> Message | None:
    """A message to frames and back; all but the last give nothing."""
    dialect = dialect or ClassicDialect()
    frames = ClassicDialect().encode(message)
    assert all(len(data) <= 8 for _, data in frames)
    found = [dialect.decode(identifier, data) for identifier, data in frames]
    assert not any(found[:-1]) or isinstance(message, Status)
    return found[-1]


@given(st.integers(0, 2**32 - 1), st.integers(-(2**63), 2**63 - 1))
def test_a_time_sync_in_two_frames(counter, time_ns):
    (first, head), (second, rest) = ClassicDialect().encode(TimeSync(counter, time_ns, 7, 1024.0))
    fields = DATABASE.decode_message(first, head) | DATABASE.decode_message(second, rest)
    assert fields == {"Counter": counter, "Pulse": 7, "Check": time_ns & 0xFFFF, "TimeNs": time_ns}
    assert through(TimeSync(counter, time_ns, NO_PULSE, 0.0)) == TimeSync(counter, time_ns, NO_PULSE, 0.0)


def test_pulses_are_counted_on_beyond_16_bits():
    dialect = ClassicDialect()
    for pulse in range(0, 150_000, 20_000):
        sync = through(TimeSync(0, pulse * 100_000_000, pulse, 0.0), dialect)
        assert isinstance(sync, TimeSync)
        assert sync.pulse == pulse


def test_a_time_whose_count_was_lost_belongs_to_nothing():
    dialect = ClassicDialect()
    frames = [dialect.encode(TimeSync(100 * k, 97_656_250 * k, k, 0.0)) for k in (1, 2)]
    assert dialect.decode(*frames[0][0]) is None
    assert dialect.decode(*frames[1][1]) is None  # the time of the second after the count of the first
    assert dialect.decode(*frames[0][1]) is None


def test_the_other_messages_come_back_and_the_database_reads_them():
    for message in (CanCommand(4, 1024.5), Reply(2, 0, 25600.0, 8), Heartbeat(2, 3, 70_000, 1, 42)):
        assert through(message) == message
    assert through(Status(70_000, (1, 2, 3, 4))) == Status(70_000, (1, 2, 3, 4))
    info = ChannelInfo(2, 3, replace(CHANNELS[2], name="acceleration-at-the-tip", direction="-y"))
    found = through(info)
    assert isinstance(found, ChannelInfo)
    assert found.channel == replace(info.channel, device=found.channel.device)
    assert (found.index, found.channels) == (2, 3)
    (reply,), status = ClassicDialect().encode(Reply(2, 0, 25600.0, 8)), ClassicDialect().encode(Status(9, (1, 2)))
    assert DATABASE.decode_message(*reply) == {
        "Opcode": "ARM", "Result": "DONE", "Decimation": 8, "SampleRate": 25600.0,
    }  # fmt: skip
    assert [DATABASE.decode_message(*frame) for frame in status] == [
        {"Channel": 0, "Overrun": 9, "Overload": 1}, {"Channel": 1, "Overrun": 9, "Overload": 2},
    ]  # fmt: skip


def test_a_description_that_lacks_a_page_is_none():
    frames = ClassicDialect().encode(ChannelInfo(0, 1, CHANNELS[0]))
    dialect = ClassicDialect()
    assert [dialect.decode(*frame) for frame in frames[:3] + frames[4:]] == [None] * 6
    assert dialect.decode(*frames[0]) is None
    assert isinstance([dialect.decode(*frame) for frame in frames][-1], ChannelInfo)


@given(st.lists(st.tuples(st.integers(0, 2047), st.binary(max_size=8))))
def test_rubbish_is_refused_or_ignored(frames):
    import struct

    dialect = ClassicDialect()
    for identifier, data in frames:
        try:
            dialect.decode(identifier, data)
        except (ValueError, struct.error):
            continue
        list(dialect.decode_samples([data]))


@given(st.integers(0, 10**12), st.integers(-32768, 32767))
def test_a_short_count_is_the_number_nearest_to_the_latest(near, step):
    assert unwrap((near + step) % 65536, 65536, near) == near + step


# --- fewer samples -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [2, 8])
def test_decimation_keeps_time_and_amplitude_and_lets_nothing_fold_back(factor):
    rate_Hz, count = 25600.0, 40_000
    lower_Hz = rate_Hz / factor
    t = np.arange(count) / rate_Hz
    kept, folded = 0.4 * lower_Hz, 0.6 * lower_Hz  # which would come back at 0.4
    values = np.stack([np.sin(2 * np.pi * kept * t + 0.3), np.sin(2 * np.pi * folded * t)])
    decimator = Decimator(2, factor)
    pieces = [decimator.take(values[:, start : start + 240]) for start in range(0, count, 240)]
    found = np.concatenate([*pieces, decimator.flush()], axis=1)
    assert found.shape[1] == -(-count // factor)
    inner = slice(2 * HALF_LENGTH, -2 * HALF_LENGTH)
    assert np.max(np.abs(found[0] - values[0, ::factor])[inner]) < 1e-4
    assert np.max(np.abs(found[1][inner])) < 1e-4


def test_a_lost_sample_costs_those_that_it_has_a_part_in_and_no_others():
    values = np.random.default_rng(2).standard_normal((1, 4000))
    spoilt = values.copy()
    spoilt[0, 2000:2010] = np.nan
    whole, holey = (
        np.concatenate((d.take(v), d.flush()), axis=1)
        for d, v in ((Decimator(1, 4), values), (Decimator(1, 4), spoilt))
    )
    lost = np.flatnonzero(np.isnan(holey[0]))
    assert lost.tolist() == list(range(500 - HALF_LENGTH, 502 + HALF_LENGTH + 1))
    rest = ~np.isnan(holey)
    assert np.array_equal(whole[rest], holey[rest])


def test_the_time_of_a_classic_frame():
    """135 bits with the worst stuffing, 111 with none (8 bytes, 11-bit identifier)."""
    assert 111e-6 < classic_frame_seconds(8, bitrate=1e6) < 135e-6
    assert 3 / classic_frame_seconds(8, bitrate=1e6) == pytest.approx(24.8e3, rel=0.02)  # samples a second in all


# --- node and host -----------------------------------------------------------------------------------------------

RATES = (
    ("unixbus", 1024.0, 1),
    ("unixbus", 25600.0, 2),
    ("virtual", 25600.0, 2),
    ("udp_multicast", 1024.0, 1),
    ("slcan", 1024.0, 1),
)
"""One channel: 25.6 kHz would fill a bus of 1 Mbit/s to 104 %.

Datagrams get lost, and a serial adapter has no end, at the speed with which a rig without limits would send those.
"""


@pytest.mark.parametrize(("interface", "rate_Hz", "decimation"), RATES)
def test_line_and_classic_can_are_one_acquisition(interface, rate_Hz, decimation, request, tmp_path):
    if interface == "udp_multicast":
        request.getfixturevalue("multicast_alone")
    where = {"virtual": "classic", "udp_multicast": "239.74.163.13"}.get(interface, f"{tmp_path}/bus")
    with (
        served(FilteredSine(rate_Hz), tcp=True, can_bus=f"{interface}:{where}", can_frames="classic") as rig,
        open_instruments(rig.on_classic_can()) as acquisition,
    ):
        assert acquisition.set_sample_rate(rate_Hz) == rate_Hz
        acquisition.start()
        acquisition.set_output(Excitation(kind="sine", amplitude_V=0.5, frequency_Hz=rate_Hz / 40))
        blocks = take(acquisition, 12)
        acquisition.stop()
        assert not acquisition.take_events()
    daq, can_ = ([block for block in blocks if block.device == name] for name in ("daq", "can"))
    for one, other in zip(daq, can_, strict=True):
        assert (one.first_index, one.time_ns) == (other.first_index * decimation, other.time_ns)
        assert other.sample_rate_Hz * decimation == one.sample_rate_Hz == rate_Hz
    got, sent = channel(blocks, "acc2"), rig.source.everything[2]
    if decimation == 1:
        assert np.array_equal(got, quantised(sent[: len(got)], 490.0))
        return
    filtered = Decimator(1, decimation).take(sent[None])[0]
    assert np.max(np.abs(got - filtered[: len(got)])) < 490.0 / 32767
    steady = slice(rig.source.changes[0] // decimation + 2 * HALF_LENGTH, len(got))
    assert np.max(np.abs(got[steady] - sent[::decimation][steady])) < 0.1  # of 30: noise and steps, no delay


def test_any_program_runs_a_classic_node_with_the_database_alone():
    with (
        served(FilteredSine(25600.0), can_bus="virtual:old", can_frames="classic", speed=1.0) as rig,
        can.Bus(interface="virtual", channel="old") as bus,
    ):
        data = DATABASE.encode_message("ClassicCommand", {"Opcode": "START", "Value": 0.0})
        bus.send(can.Message(arbitration_id=0x208, data=data, is_extended_id=False))
        values: dict[int, float] = {}
        expected = {f"Classic{name}" for name in ("Sync", "SyncTime", "Samples0", "Samples2", "Heartbeat", "Reply")}
        names = set()
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until and not (expected <= names and len(values) > 1000):
            message = bus.recv(0.1)
            if message is None:
                continue
            assert not message.is_fd
            fields = DATABASE.decode_message(message.arbitration_id, bytes(message.data), allow_truncated=True)
            names.add(DATABASE.get_message_by_frame_id(message.arbitration_id).name)
            if message.arbitration_id == 0x209:
                assert (fields["Result"], fields["Decimation"], fields["SampleRate"]) == ("DONE", 8, 25600.0)
            if message.arbitration_id == 0x10A:
                values.update({fields["Counter"] + k: 490.0 * fields[f"S{k:02d}"] for k in range(3)})
        sent = rig.source.everything[2]
    assert expected <= names
    assert sorted(values) == list(range(len(values)))
    assert len(values) > 1000
    filtered = Decimator(1, 8).take(sent[None])[0]
    assert max(abs(value - filtered[k]) for k, value in values.items() if k < len(filtered)) < 490.0 / 32767
