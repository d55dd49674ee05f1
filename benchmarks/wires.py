"""Benchmarks of wires and files for ``twin speed``: framed serial, recording, acquisition, CAN FD at its capacity.

The error is the largest difference of a sample that arrived from the one that was sent; infinite if any was lost.
"""

from __future__ import annotations

import math
import os
import pty
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from mcap.writer import CompressionType, Writer

from benchmarks.measured import Measured
from drivers.can_protocol import SAMPLES_PER_FRAME
from drivers.frames import Decoder, encode_samples, unpack_samples
from drivers.host import open_instruments
from drivers.virtual import Addresses, VirtualRig
from drivers.virtual.bus_time import frame_seconds
from drivers.virtual.tone import Tone
from recordings import RunWriter, SampleBlock, read_run
from recordings.container.messages import encode_block
from recordings.container.schema import SAMPLE_BLOCK, schema_data

RATE_Hz = 25600.0
CHANNELS = ("force", "acc1", "acc2", "acc3")
REALTIME_BYTES_per_s = len(CHANNELS) * RATE_Hz * 4
FRAME_SAMPLES = 4000
"""Of every channel in a frame: as many as an instrument puts in one where it runs as fast as its line."""


def framed_serial(*, size_bytes: int = 8 << 20, rounds: int = 15) -> Measured:
    """Frames encoded in one process and decoded in another, against the same bytes over the same pseudo-terminal.

    How long two processes take to pass bytes depends on how they are put on the cores, up to a factor of four: each
    round compares its own two, and the median of the rounds counts.
    """
    _, size = _frames(1)
    count = size_bytes // size
    raw, framed, error = [], [], 0.0
    for _ in range(rounds):
        raw.append(_pty_seconds(_send_raw, count, _read_raw)[0])
        seconds, wrong = _pty_seconds(_send_framed, count, _read_framed)
        framed.append(seconds)
        error = max(error, wrong)
    usual = median(framed)
    return Measured(
        ratio=median(one / other for one, other in zip(raw, framed, strict=True)), promise=0.6,
        against="the raw pseudo-terminal", error=error, threads=1,
        more={
            "raw_MB_per_s": 1e-6 * count * size / median(raw), "framed_MB_per_s": 1e-6 * count * size / usual,
            "times_real_time": count * size / usual / REALTIME_BYTES_per_s,
        },
    )  # fmt: skip


def _frames(count: int) -> tuple[Callable[[int], bytes], int]:
    """A function that encodes frame number k of a tone, and the size of a frame."""
    import numpy as np

    tone = Tone(CHANNELS, sample_rate_Hz=RATE_Hz)
    samples = np.stack([tone.values(name, 0, FRAME_SAMPLES) for name in CHANNELS])
    none = np.zeros(len(CHANNELS), np.uint32)

    def frame(number: int) -> bytes:
        return encode_samples(
            samples, overload=none, first_index=number * FRAME_SAMPLES, time_ns=number, sample_rate_Hz=RATE_Hz,
            sequence=number,
        )  # fmt: skip

    return frame, len(frame(0))


def _pty_seconds(
    send: Callable[[int, int], None], count: int, read: Callable[[int, int], float]
) -> tuple[float, float]:
    """Time from the first to the last byte of `count` frames that a child sends, and what the reader found wrong."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    child = os.fork()  # a fresh interpreter would take longer to start than the bytes to pass
    if child == 0:
        try:
            send(master, count)
            os.read(master, 1)  # what has not been read when it hangs up would be gone
        finally:
            os._exit(0)
    os.close(master)
    try:
        os.read(slave, 1)  # it sends one byte ahead: everything is imported and ready
        began = time.perf_counter()
        wrong = read(slave, count)
        took = time.perf_counter() - began
        os.write(slave, b"x")
        return took, wrong
    finally:
        os.close(slave)
        os.waitpid(child, 0)


def _write_all(descriptor: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


def _send_raw(descriptor: int, count: int) -> None:
    frame, _ = _frames(count)
    data = frame(0)
    _write_all(descriptor, b"x")
    for _ in range(count):
        _write_all(descriptor, data)


def _send_framed(descriptor: int, count: int) -> None:
    frame, _ = _frames(count)
    _write_all(descriptor, b"x")
    for number in range(count):
        _write_all(descriptor, frame(number))


def _read_raw(descriptor: int, count: int) -> float:
    left = count * _frames(count)[1]
    while left:
        left -= len(os.read(descriptor, min(left, 1 << 16)))
    return 0.0


def _read_framed(descriptor: int, count: int) -> float:

    tone = Tone(CHANNELS, sample_rate_Hz=RATE_Hz)
    decoder, found, error = Decoder(), 0, 0.0
    while found < count:
        for frame in decoder.feed(os.read(descriptor, 1 << 16)):
            values, _ = unpack_samples(frame)
            if found % 64 == 0:  # comparing all of them would be what is timed
                error = max(error, float(abs(values[1] - tone.values(CHANNELS[1], 0, FRAME_SAMPLES)).max()))
            found += 1
    return error if decoder.lost_frames + decoder.bad_payloads + decoder.bad_headers == 0 else float("inf")


def recording(*, count: int = 400, rounds: int = 7) -> Measured:
    """Blocks into a run, against the same messages through the bare MCAP writer; in processor time."""
    blocks = list(_blocks(count))
    messages = [(block.time_ns, encode_block(block)) for block in blocks]

    def bare(path: Path) -> None:
        with path.open("wb") as stream:
            writer = Writer(stream, chunk_size=64 << 10, compression=CompressionType.LZ4, enable_data_crcs=True)
            writer.start()
            schema = writer.register_schema(SAMPLE_BLOCK, "protobuf", schema_data())
            topic = writer.register_channel("/samples/tone", "protobuf", schema)
            for number, (time_ns, data) in enumerate(messages):
                writer.add_message(topic, log_time=time_ns, publish_time=time_ns, data=data, sequence=number)
            writer.finish()

    def ours(path: Path) -> None:
        with RunWriter(path, info={"source": "simulated"}, channels=_channels(), overwrite=True) as writer:
            for block in blocks:
                writer.write_block(block)

    seconds = {bare: 1e9, ours: 1e9}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            for work in seconds:
                path = Path(folder, f"{work.__name__}.mcap")
                began = time.process_time()
                work(path)
                seconds[work] = min(seconds[work], time.process_time() - began)
        error = _difference(Path(folder, "ours.mcap"))
    size = sum(len(data) for _, data in messages)
    return Measured(
        ratio=seconds[bare] / seconds[ours], promise=0.5, against="the bare MCAP writer", error=error, threads=1,
        more={"MB_per_s": 1e-6 * size / seconds[ours]},
    )  # fmt: skip


def _channels() -> list[Any]:

    return [replace(channel, device="tone") for channel in Tone(CHANNELS).channels]


def _blocks(count: int) -> Iterator[SampleBlock]:

    tone = Tone(CHANNELS, sample_rate_Hz=RATE_Hz)
    for _ in range(count):
        yield tone.read(7680)


def _difference(path: Path) -> float:
    """Largest difference of a recorded sample from the tone's."""
    tone = Tone(CHANNELS, sample_rate_Hz=RATE_Hz)
    device = read_run(path).devices["tone"]
    return max(float(abs(values - tone.values(name, 0, len(values))).max()) for name, values in device.values.items())


def acquisition(*, seconds: float = 5.0) -> Measured:
    """Four channels at 25.6 kHz over a line, recorded: how many such acquisitions one core could do at a time."""
    with _served("tcp") as (acquisition, tone), tempfile.TemporaryDirectory() as folder:
        with RunWriter(Path(folder, "run.mcap"), info={"source": "simulated"}, channels=acquisition.channels) as writer:
            acquisition.start()
            acquisition.read()  # from here on it runs evenly
            began, used = time.perf_counter(), time.process_time()
            error, samples = 0.0, 0
            while time.perf_counter() - began < seconds:
                for block in acquisition.read():
                    writer.write_block(block)
                    samples += len(block)
            used, took = time.process_time() - used, time.perf_counter() - began
            error = max(
                float(abs(values - tone.values(name, block.first_index, len(block))).max())
                for name, values in block.samples.items()
            )
            acquisition.stop()
        lost = [event for event in acquisition.take_events() if event.kind in ("lost-samples", "overrun")]
    return Measured(
        ratio=took / used, promise=4, against="real time on one core", error=math.inf if lost else error, threads=2,
        more={"cores_used": used / took, "samples_per_s": samples / took},
    )  # fmt: skip


def can_fd_at_capacity(*, seconds: float = 5.0) -> Measured:
    """Four channels on one bus at 1 and 5 Mbit/s, as fast as it carries them, against what it can by its bit rates."""
    capacity_Hz = SAMPLES_PER_FRAME / frame_seconds(64, bitrate=1e6, data_bitrate=5e6) / len(CHANNELS)
    rate_Hz = float(int(0.98 * capacity_Hz))  # the rest is for time sync, heartbeats and answers
    with _served("can", rate_Hz) as (acquisition, tone):
        acquisition.start()
        acquisition.read()  # from here on it runs evenly
        began, took, error, samples = time.perf_counter(), 0.0, 0.0, 0
        while took < seconds:
            for block in acquisition.read():
                if block.device == "can":
                    samples += len(block)
                    error = max(error, _off_by_counts(block, tone))
            took = time.perf_counter() - began
        acquisition.stop()
        events = [event.kind for event in acquisition.take_events()]
    lost = {"lost-samples", "overrun"} & set(events)
    return Measured(
        ratio=samples / took / capacity_Hz, promise=0.95, against="the bus's computed capacity",
        error=math.inf if lost else error, threads=3,
        more={"samples_per_s": samples / took, "error_unit": "steps of the 16-bit converter"},
    )  # fmt: skip


def _off_by_counts(block: SampleBlock, tone: Any) -> float:
    """Largest difference from the tone, in steps of the node's 16-bit converter; half a step is its rounding."""
    limits = {channel.name: channel.range / 32767 for channel in tone.channels}
    return max(
        float(abs(values - tone.values(name, block.first_index, len(block))).max()) / limits[name]
        for name, values in block.samples.items()
    )


@contextmanager
def _served(kind: str, sample_rate_Hz: float = RATE_Hz) -> Iterator[tuple[Any, Any]]:
    """An acquisition of instruments in a process of their own in real time, and their tone."""
    names = CHANNELS if kind == "tcp" else ("voltage", *CHANNELS)
    code = "import sys; from benchmarks.wires import serve_tone; serve_tone(*sys.argv[1:])"
    with tempfile.TemporaryDirectory() as folder:
        arguments = [sys.executable, "-c", code, folder, ",".join(names), kind, str(sample_rate_Hz)]
        with subprocess.Popen(arguments, stdin=subprocess.PIPE) as process:
            try:
                instruments = Path(folder, "instruments.toml")
                give_up = time.monotonic() + 60
                while not instruments.exists():
                    if process.poll() is not None or time.monotonic() > give_up:
                        raise RuntimeError("the virtual instruments did not start")
                    time.sleep(0.02)
                with open_instruments(instruments) as acquisition:
                    yield acquisition, Tone(names, sample_rate_Hz=sample_rate_Hz)
            finally:
                process.kill()


def serve_tone(folder: str, names: str, kind: str, sample_rate_Hz: str) -> None:
    """Body of the instruments' process, until its standard input ends."""
    addresses = Addresses(tcp="127.0.0.1:0")
    if kind == "can":
        addresses = Addresses(tcp="127.0.0.1:0", can=f"unixbus:{folder}/bus", can_channels=CHANNELS)
    rig = VirtualRig(Tone(names.split(","), sample_rate_Hz=float(sample_rate_Hz)), addresses, speed=1.0)
    part = Path(folder, "instruments.part")
    part.write_text(rig.instruments_toml, encoding="utf-8")
    part.rename(Path(folder, "instruments.toml"))
    ended = threading.Event()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait_for_the_end, daemon=True).start()
    rig.serve(ended.is_set)


BENCHMARKS: Mapping[str, Callable[[], Measured]] = {
    "framed-serial": framed_serial,
    "recording": recording,
    "acquisition": acquisition,
    "can-fd-at-capacity": can_fd_at_capacity,
}
"""By name."""
