"""The framed stream: bytes as documented, whole in any cut, and damage costs what was damaged."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.frames import MAX_PAYLOAD, Decoder, Frame, FrameKind, encode, encode_samples, unpack_samples

frames = st.builds(
    Frame,
    kind=st.sampled_from([FrameKind.SAMPLES, FrameKind.PULSE]),
    sequence=st.just(0),
    channels=st.integers(0, 255),
    first_index=st.integers(0, 2**64 - 1),
    time_ns=st.integers(-(2**63), 2**63 - 1),
    sample_rate_Hz=st.floats(1, 1e6),
    payload=st.binary(max_size=300),
)


def numbered(these: list[Frame]) -> list[Frame]:
    return [
        Frame(**{name: getattr(f, name) for name in f.__slots__} | {"sequence": i & 0xFFFF})
        for i, f in enumerate(these)
    ]


def test_bytes_are_as_the_table_says():
    samples = np.array([[1.5, -2.0], [3.25, 4.0]], np.float32)
    data = encode_samples(
        samples, overload=np.array([0, 7], np.uint32), first_index=2**40, time_ns=-5, sample_rate_Hz=1024.0, sequence=9
    )
    assert data[:4] == b"\xd7RIG"
    kind, channels, sequence, length, index, time_ns, rate = struct.unpack_from("<BBHIQqd", data, 4)
    assert (kind, channels, sequence, length, index, time_ns, rate) == (1, 2, 9, 24, 2**40, -5, 1024.0)
    assert struct.unpack_from("<I", data, 36)[0] == zlib.crc32(data[4:36])
    assert struct.unpack_from("<2I4f", data, 40) == (0, 7, 1.5, -2.0, 3.25, 4.0)
    assert struct.unpack_from("<I", data, 64)[0] == zlib.crc32(data[40:64])
    assert len(data) == 68


@given(st.lists(frames, max_size=8), st.lists(st.integers(1, 97), min_size=1, max_size=20))
def test_frames_survive_any_cut(these, cuts):
    these = numbered(these)
    stream = b"".join(map(encode, these))
    decoder, out, position, i = Decoder(), [], 0, 0
    while position < len(stream):
        size = cuts[i % len(cuts)]
        out += decoder.feed(stream[position : position + size])
        position, i = position + size, i + 1
    assert out == these
    assert (decoder.bad_headers, decoder.bad_payloads, decoder.lost_frames, decoder.skipped_bytes) == (0, 0, 0, 0)


@given(st.lists(frames, min_size=3, max_size=8), st.data())
def test_one_flipped_bit_costs_one_frame_and_is_counted(these, data):
    these = numbered(these)
    parts = [encode(frame) for frame in these]
    hit = data.draw(st.integers(0, len(parts) - 2))
    bit = data.draw(st.integers(0, 8 * len(parts[hit]) - 1))
    damaged = bytearray(parts[hit])
    damaged[bit // 8] ^= 1 << (bit % 8)
    decoder = Decoder()
    out = decoder.feed(b"".join([*parts[:hit], bytes(damaged), *parts[hit + 1 :]]))
    assert out == these[:hit] + these[hit + 1 :]
    assert decoder.lost_frames == (1 if hit else 0)  # before the first frame there was no number to compare
    assert decoder.skipped_bytes == len(damaged)


def test_a_late_frame_is_not_missing_and_a_repeated_one_is_not_late():
    stream = [encode(Frame(kind=FrameKind.PULSE, sequence=number & 0xFFFF)) for number in range(65533, 65543)]
    stream[1], stream[4] = stream[4], stream[1]  # three late frames and one early one, across the wrap of the numbers
    del stream[7]
    decoder = Decoder()
    frames = decoder.feed(b"".join([*stream, stream[2]]))
    assert (len(frames), decoder.lost_frames, decoder.late_frames) == (10, 1, 3)


@given(st.lists(st.binary(max_size=2000), max_size=10))
def test_rubbish_gives_nothing_and_is_not_kept(chunks):
    decoder = Decoder()
    for chunk in chunks:
        for frame in decoder.feed(chunk):
            assert zlib.crc32(frame.payload) >= 0  # a frame out of rubbish has passed two checksums
    assert len(decoder._buffer) <= MAX_PAYLOAD + 44


def test_a_sync_word_with_a_huge_length_does_not_swallow_what_follows():
    header = struct.pack("<BBHIQqd", 1, 1, 0, 2**31, 0, 0, 1.0)
    bad = b"\xd7RIG" + header + struct.pack("<I", zlib.crc32(header))
    good = Frame(kind=FrameKind.PULSE, sequence=0, payload=b"1234")
    decoder = Decoder()
    assert decoder.feed(bad + encode(good)) == [good]
    assert decoder.bad_headers == 1


def test_plain_text_after_the_end_frame_is_left_alone():
    decoder = Decoder()
    (end,) = decoder.feed(encode(Frame(kind=FrameKind.END, sequence=0)) + b"1024.0\n")
    assert end.kind == FrameKind.END
    assert decoder._buffer == b"1024.0\n"


def test_samples_come_back_bit_for_bit():
    samples = np.random.default_rng(0).standard_normal((3, 500)).astype(np.float32)
    samples[1, 7] = np.nan
    (frame,) = Decoder().feed(
        encode_samples(
            samples, overload=np.zeros(3, np.uint32), first_index=0, time_ns=0, sample_rate_Hz=1.0, sequence=0
        )
    )
    assert np.array_equal(unpack_samples(frame)[0].view(np.uint32), samples.view(np.uint32))


@given(st.integers(0, 255), st.binary(max_size=200))
def test_a_payload_that_does_not_fit_its_channels_is_refused(channels, payload):
    frame = Frame(kind=FrameKind.SAMPLES, sequence=0, channels=channels, payload=payload)
    size = len(payload) - 4 * channels
    if channels == 0 or size < 0 or size % (4 * channels):
        with pytest.raises(ValueError, match="payload"):
            unpack_samples(frame)
    else:
        assert unpack_samples(frame)[0].shape == (channels, size // (4 * channels))


def test_a_payload_beyond_the_limit_is_not_sent():
    with pytest.raises(ValueError, match="limit"):
        encode(Frame(kind=FrameKind.TEXT, sequence=0, payload=bytes(MAX_PAYLOAD + 1)))
