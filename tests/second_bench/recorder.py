"""Runs the tests on the bench and writes their recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from recordings import RunWriter, SampleBlock, Step, StepState
from tests.second_bench.believed import PRELOAD, SHAKER, TRANSDUCERS, rig_text
from tests.second_bench.channels import DEVICE, Reading, Wiring, announced
from tests.second_bench.mechanics.bench import Bench
from tests.second_bench.mechanics.specimen import Specimen
from tests.second_bench.plans import Noise, Sweeps
from tests.second_bench.shaker import Distortion, noise, sine
from tests.second_bench.sine_wave import fundamental

Array = NDArray[np.float64]

HELD = 3e-3
"""Deviation of the force from what it was to be, as a share; drawn for each step."""
SETTLED = 5e-5
"""Change of the response in a block, relative, below which it has settled; waiting ends after `LONGEST_s` anyway."""
LONGEST_s = 30.0
STARTED = datetime(2026, 3, 2, 9, tzinfo=UTC)


@dataclass(eq=False)
class Campaign:
    """What the recordings of one rig have in common; its clock goes on from one to the next.

    Attributes
    ----------
    specimen
        As it is.
    wiring
        Of each channel.
    rng
        Draws noise, and what is not held exactly.
    stored
        Whether the waits are recorded too: ``all`` or ``settled``.
    wander
        Standard deviation of all resonances from sweep to sweep, relative.
    clock_s
        Recorded so far.
    """

    specimen: Specimen
    wiring: dict[str, Wiring]
    rng: np.random.Generator
    stored: str
    wander: float = 0.0
    clock_s: float = 0.0

    def record_noise(self, path: Path, plan: Noise) -> None:
        """Record a broadband test."""
        with self._open(path, "random", plan.march_Hz, plan.stored_Hz) as recording:
            bench = self._bench()
            force = noise(
                self.rng, bench.modes, SHAKER, band_Hz=plan.band_Hz, rms=plan.rms,
                samples=plan.seconds * plan.march_Hz, rate_Hz=plan.march_Hz,
            )  # fmt: skip
            step = ("random", 0, 0.0, plan.rms)
            recording.announce(StepState.MEASURING, *step)
            for block in np.split(force, plan.seconds * 2, axis=1):
                recording.take(block[1], bench.run(block[0], plan.march_Hz), stored=True)
            recording.announce(StepState.DONE, *step)
            self.clock_s = bench.clock_s

    def record_sweeps(self, path: Path, plan: Sweeps) -> None:
        """Record sweeps, each force from the lowest frequency to the highest, waiting at each for the response."""
        stored = self.stored == "all"
        with self._open(path, "stepped-sine", plan.march_Hz, plan.stored_Hz) as recording:
            distortion = Distortion.drawn(self.rng)
            for force_N in plan.forces_N:
                bench = self._bench()
                drive = _Drive(bench, recording, plan, distortion)
                for index, frequency in enumerate(plan.frequencies_Hz):
                    step = (plan.sweep(force_N), index, frequency, force_N)
                    amplitude = force_N * (1 + HELD * self.rng.normal())
                    if stored:
                        recording.announce(StepState.SETTLING, *step)
                    drive.settle(amplitude, frequency, stored=stored)
                    recording.announce(StepState.MEASURING, *step)
                    for _ in range(round(plan.measured_s / plan.block_s)):
                        drive.block(amplitude, frequency, stored=True)
                self.clock_s = bench.clock_s
            recording.announce(StepState.DONE, *step)

    def _bench(self) -> Bench:
        return Bench(self.specimen, clock_s=self.clock_s, wander=2 * self.wander * self.rng.normal())

    def _open(self, path: Path, procedure: str, march_Hz: int, stored_Hz: int) -> _Recording:
        info = {
            "source": "simulated", "rig": "second-bench", "procedure": procedure, "stored": self.stored,
            "preload_N": PRELOAD.removesuffix("N"),
            "started": (STARTED + timedelta(seconds=self.clock_s)).isoformat().replace("+00:00", "Z"),
        }  # fmt: skip
        readings = [
            Reading(t, self.wiring[t.channel], rate_Hz=march_Hz, keep_each=march_Hz // stored_Hz, rng=self.rng)
            for t in TRANSDUCERS
        ]
        started_ns = round((STARTED.timestamp() + self.clock_s) * 1e9)
        return _Recording(path, info, readings, started_ns=started_ns, stored_Hz=stored_Hz)


@dataclass(eq=False)
class _Drive:
    """A sine whose phase goes on from step to step."""

    bench: Bench
    recording: _Recording
    plan: Sweeps
    distortion: Distortion
    phase: float = 0.0

    def block(self, amplitude: float, frequency_Hz: float, *, stored: bool) -> complex:
        """Go on for a block; the response's complex amplitude at the last sensor, m/s2."""
        rate_Hz = self.plan.march_Hz
        steps = np.arange(1, round(self.plan.block_s * rate_Hz) + 1)
        phases = self.phase + 2 * np.pi * frequency_Hz / rate_Hz * steps
        self.phase = float(phases[-1]) % (2 * np.pi)
        marched, read = sine(amplitude, frequency_Hz, self.distortion, phases, rate_Hz)
        acceleration = self.bench.run(marched, rate_Hz, recorded=stored)
        self.recording.take(read, acceleration, stored=stored)
        return fundamental(acceleration[-1], phases)

    def settle(self, amplitude: float, frequency_Hz: float, *, stored: bool) -> None:
        """Wait until the response changes no more."""
        before = self.block(amplitude, frequency_Hz, stored=stored)
        for _ in range(round(LONGEST_s / self.plan.block_s)):
            now = self.block(amplitude, frequency_Hz, stored=stored)
            if abs(now - before) < SETTLED * abs(now):
                return
            before = now


class _Recording:
    """A file that is being written; use it in a ``with`` statement."""

    def __init__(
        self, path: Path, info: dict[str, str], readings: list[Reading], *, started_ns: int, stored_Hz: int
    ) -> None:
        self._writer = RunWriter(
            path, info=info, channels=announced(), attachments={"rig.toml": rig_text().encode()}, overwrite=True
        )
        self._readings, self._started_ns, self._stored_Hz, self._count = readings, started_ns, stored_Hz, 0

    def __enter__(self) -> _Recording:
        self._writer.__enter__()
        return self

    def __exit__(self, *error) -> None:
        self._writer.__exit__(*error)

    @property
    def _now_ns(self) -> int:
        return self._started_ns + round(self._count * 1e9 / self._stored_Hz)

    def announce(self, state: StepState, sweep: str, index: int, frequency_Hz: float, target: float) -> None:
        """Write what the test is doing from now on."""
        self._writer.write_step(
            Step(
                time_ns=self._now_ns, sweep=sweep, index=index, frequency_Hz=frequency_Hz, target_channel="force",
                target_amplitude=target, state=state,
            )
        )  # fmt: skip

    def take(self, force: Array, acceleration: Array, *, stored: bool) -> None:
        """Read the channels; write what they read."""
        taken = [
            reading.read(signal, stored=stored)
            for reading, signal in zip(self._readings, self._signals(force, acceleration), strict=True)
        ]
        if not stored:
            return
        names = [reading.transducer.channel for reading in self._readings]
        block = SampleBlock(
            device=DEVICE, time_ns=self._now_ns, first_index=self._count, sample_rate_Hz=self._stored_Hz,
            samples={name: values for name, (values, _) in zip(names, taken, strict=True)},
            overload={name: over for name, (_, over) in zip(names, taken, strict=True) if over},
        )  # fmt: skip
        self._writer.write_block(block)
        self._count += len(block)

    @staticmethod
    def _signals(force: Array, acceleration: Array) -> Iterator[Array]:
        yield force
        yield from acceleration
