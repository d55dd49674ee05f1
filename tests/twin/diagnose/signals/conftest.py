"""Runs put together from sines, noise and whatever fault a test adds."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from recordings.run import Channel, DeviceSamples, Run, Step, StepState

RATE_Hz, STEP_s = 2048.0, 1.0
RANGE = {"force": 50.0, "acc1": 490.0, "acc2": 490.0}
NOISE = {"force": 0.01, "acc1": 0.03, "acc2": 0.03}
BITS = 24
FREQUENCIES_Hz = np.round(np.linspace(25.6, 27.2, 16), 3)


def make_run(samples, frequencies_Hz=FREQUENCIES_Hz, *, path="run.mcap", step_s=STEP_s, limits=RANGE):
    """A run whose steps of equal length are all measured; frequency 0 is broadband."""
    length = round(step_s * RATE_Hz)
    steps = [
        Step(
            time_ns=round(1e9 * k * length / RATE_Hz), sweep="up", index=k, frequency_Hz=float(f),
            target_channel="force", target_amplitude=1.0, state=StepState.MEASURING,
        )
        for k, f in enumerate(frequencies_Hz)
    ]  # fmt: skip
    end = replace(steps[-1], time_ns=round(1e9 * len(steps) * length / RATE_Hz), state=StepState.DONE)
    device = DeviceSamples(
        device="daq", sample_rate_Hz=RATE_Hz, values={name: np.float32(x) for name, x in samples.items()},
        block_start=np.array([0]), block_time_ns=np.array([0]), overload={},
    )  # fmt: skip
    channels = {
        name: Channel(
            name=name, quantity="force" if name == "force" else "acceleration",
            unit="N" if name == "force" else "m/s^2", range=limits[name],
        )
        for name in samples
    }  # fmt: skip
    return Run(path=path, info={"source": "measured"}, channels=channels, devices={"daq": device},
               steps=(*steps, end), events=())  # fmt: skip


def converted(samples, bits=BITS):
    """Samples as a converter of so many bits over its range gives them."""
    return {name: np.round(x / (s := 2 * RANGE[name] / 2**bits)) * s for name, x in samples.items()}


def stepped_sine(seed, *, frequencies_Hz=FREQUENCIES_Hz, step_s=STEP_s, noise=1.0):
    """A force of 1.5 N, accelerations of a resonance passed through with some third harmonic, and white noise."""
    rng = np.random.default_rng(seed)
    length = round(step_s * RATE_Hz)
    out = {name: [] for name in RANGE}
    for frequency in frequencies_Hz:
        t = np.arange(length) / RATE_Hz
        w = 2 * np.pi * frequency
        turn = np.exp(1j * (w * t + 2 * np.pi * rng.random()))
        H = 5.0 / ((26.4**2 - frequency**2) / 26.4**2 + 0.005j)
        response = np.real(1.5e-2 * H * turn + 1e-4 * abs(H) * turn**3)
        for name, x in (("force", 1.5 * turn.real), ("acc1", 0.7 * response), ("acc2", response)):
            out[name].append(x + noise * NOISE[name] * rng.standard_normal(length))
    return {name: np.concatenate(parts) for name, parts in out.items()}


def random_noise(seed, seconds=12.0):
    """Broadband force and two responses that it leaves its mark on."""
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE_Hz)
    force = 0.5 * rng.standard_normal(count)
    out = {"force": force}
    for name in ("acc1", "acc2"):
        out[name] = 3.0 * np.convolve(force, rng.standard_normal(40), "same") + NOISE[name] * rng.standard_normal(count)
    return out


@pytest.fixture(scope="session")
def synthetic():
    """Builders of runs."""
    return SimpleNamespace(
        run=make_run,
        converted=converted,
        stepped_sine=stepped_sine,
        random=random_noise,
        rate_Hz=RATE_Hz,
        noise=NOISE,
        ranges=RANGE,
        frequencies_Hz=FREQUENCIES_Hz,
    )


@pytest.fixture(scope="session")
def clean_runs(synthetic):
    """A dozen stepped sines and as many broadband runs with nothing wrong, each from a seed of its own."""
    sines = [synthetic.run(synthetic.converted(synthetic.stepped_sine(seed))) for seed in range(12)]
    noises = [
        synthetic.run(synthetic.converted(synthetic.random(seed)), [0.0], path="random.mcap", step_s=12.0)
        for seed in range(100, 112)
    ]
    return list(zip(sines, noises, strict=True))
