"""A rig without physics for tests of the wire: a sine through a one-pole filter, with noise; and a way to serve it."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drivers.instruments import Instruments
from drivers.virtual import Addresses, Backing, Protection, VirtualRig, parse_fault
from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation, SlowSource

PATIENCE_S = 60.0
"""What a busy machine may take for what takes no time; where a limit is itself tried, a test names its own."""

VISA_OPTIONS = {"read_termination": "\n", "write_termination": "\n", "timeout": 1000 * PATIENCE_S}
"""With which PyVISA opens an instrument."""


def wait_until(condition: Callable[[], object], *, step: Callable[[], object] = lambda: time.sleep(0.01)) -> None:
    """Until something has happened, which `step` brings nearer; AssertionError if it never does."""
    give_up = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < give_up, "it has not come"
        step()


def wait_until_asleep(process: subprocess.Popen[Any]) -> None:
    """Until another program waits for something new: then it has taken what it was sent."""
    asleep = 0

    def look() -> None:
        nonlocal asleep
        state = Path(f"/proc/{process.pid}/stat").read_text().rpartition(") ")[2][0]
        asleep = asleep + 1 if state == "S" else 0
        time.sleep(0.02)

    wait_until(lambda: asleep == 10, step=look)


CHANNELS = (
    Channel(name="force", quantity="force", unit="N", position_m=0.05, range=50.0),
    Channel(name="acc1", quantity="acceleration", unit="m/s^2", position_m=0.30, range=490.0),
    Channel(name="acc2", quantity="acceleration", unit="m/s^2", position_m=0.42, range=490.0),
)


@dataclass
class FilteredSine:
    """Every channel is the drive through its own gain and phase, plus noise; remembers all it ever gave."""

    rate_Hz: float = 1024.0
    length: int | None = None
    index: int = 0
    phase: float = 0.0
    excitation: Excitation = field(default_factory=Excitation)
    given: list[np.ndarray] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)

    channels = CHANNELS

    def __post_init__(self) -> None:
        self._noise = np.random.default_rng(1)

    @property
    def sample_rate_Hz(self) -> float:
        return self.rate_Hz

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        self.rate_Hz = float(min((512.0, 1024.0, 2048.0, 5120.0, 25600.0), key=lambda r: abs(r - sample_rate_Hz)))
        return self.rate_Hz

    def set_output(self, excitation: Excitation) -> None:
        self.excitation = excitation
        self.changes.append(self.index)

    def read(self, count: int) -> SampleBlock:
        if self.length is not None:
            count = min(count, self.length - self.index)
        steps = 2 * np.pi * self.excitation.frequency_Hz / self.rate_Hz * np.arange(count)
        volts = self.excitation.amplitude_V * (self.excitation.kind == "sine")
        values = np.stack([gain * volts * np.sin(self.phase + steps + lag) for gain, lag in ((5, 0), (40, 1), (60, 2))])
        values = (values + 0.01 * self._noise.standard_normal((3, count))).astype(np.float32)
        self.phase += 2 * np.pi * self.excitation.frequency_Hz / self.rate_Hz * count
        block = SampleBlock(
            device="rig",
            time_ns=round(self.index * 1e9 / self.rate_Hz),
            first_index=self.index,
            sample_rate_Hz=self.rate_Hz,
            samples={channel.name: row for channel, row in zip(CHANNELS, values, strict=True)},
        )
        self.index += count
        self.given.append(values)
        return block

    @property
    def everything(self) -> np.ndarray:
        return np.concatenate(self.given, axis=1)


class SlowRoom:
    """A preload that falls by 2 N a second and a temperature that rises by 0.5 K."""

    channels = (
        Channel(name="preload", quantity="preload", unit="N", range=1000.0, device="meter"),
        Channel(name="temperature", quantity="temperature", unit="degC", range=100.0, device="meter"),
    )

    def read(self, time_s: float) -> list[float]:
        return [540.0 - 2.0 * time_s, 20.0 + 0.5 * time_s]


@dataclass
class Served:
    """Addresses of the virtual instruments of a source."""

    source: FilteredSine
    serial: str | None
    tcp: str | None
    can: str | None
    meter: str | None = None
    patience: dict[str, float] = field(default_factory=dict)
    stop_at_once: Callable[[str], None] = field(default=print)

    def instruments(self, **options: object) -> Instruments:
        """What the instruments file would say, with more patience than it has of itself."""
        address = f"serial:{self.serial}" if self.serial else f"tcp:{self.tcp}"
        devices: list[dict[str, object]] = [{"name": "daq", "address": address, "generator": True}]
        if self.can:
            devices.append({"name": "can", "address": f"can:{self.can}"})
        if self.meter:
            devices.append({"name": "meter", "address": self.meter, "kind": "meter"})
        return Instruments.model_validate({"device": devices, **self.patience, **options})

    def on_classic_can(self) -> Instruments:
        """The same with the node's messages in frames of eight bytes."""
        settings = self.instruments().model_dump(mode="json", exclude_none=True)
        settings["device"][1]["frames"] = "classic"
        return Instruments.model_validate(settings)


@contextmanager
def served(
    source: FilteredSine,
    *,
    serial: bool = False,
    tcp: bool | str = False,
    can_bus: str | None = None,
    speed: float | None = None,
    faults: Sequence[str] = (),
    link: Path | None = None,
    meter: str | None = None,
    slow: SlowSource | None = None,
    protection: Protection | None = None,
    **wire: Any,
) -> Iterator[Served]:
    """Virtual instruments in a thread of this process."""
    rig = VirtualRig(
        source,
        Addresses(
            serial=str(link or "auto") if serial else None,
            tcp="127.0.0.1:0" if tcp is True else tcp or None,
            can=can_bus,
            meter=meter,
            **wire,
        ),
        speed=speed, faults=[parse_fault(text) for text in faults], seed=3,
        protection=protection or Protection(watchdog_s=PATIENCE_S),
        backing=Backing(slow=slow or (SlowRoom() if meter else None)),
    )  # fmt: skip
    where = {key: value for entry in rig.ready if entry["device"] != "meter" for key, value in entry.items()}
    meters = [
        f"{key}:{entry[key]}"
        for entry in rig.ready
        if entry["device"] == "meter"
        for key in ("serial", "tcp")
        if key in entry
    ]
    stop = threading.Event()
    thread = threading.Thread(target=rig.serve, args=(stop.is_set,))
    thread.start()
    try:
        # What a fault has swallowed is asked for again after a part of the time-out.
        patience = {"timeout_s": 6.0 if faults else 30.0, "reconnect_s": PATIENCE_S, "silence_s": PATIENCE_S}
        meter_at = meters[0] if meters else None
        yield Served(
            source, where.get("serial"), where.get("tcp"), where.get("can"), meter_at, patience, rig.stop_at_once
        )
    finally:
        stop.set()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()
