"""Hits on a structure that is a sum of two modes, by its impulse responses alone: no mesh, no bench."""

from __future__ import annotations

import numpy as np

from recordings import Channel, Run
from recordings.run import DeviceSamples, Step, StepState

RATE_Hz = 2048.0
NATURAL_Hz, RATIO = np.array([90.0, 230.0]), np.array([0.004, 0.003])
SHAPE = np.array([[1.0, 0.8], [-0.4, 1.0], [0.7, -0.9]])
"""Of the points (3,) in the two modes; the sensor sits at the first one."""
PROCEDURE = b'procedure = "impact"\nrecord = 2.0\npre_trigger = 0.1\nhits = 3\n'
PEAK_N, WIDTH_s, PRE = 20.0, 4e-3, 205


def velocity_per_force(s):
    """Mobility (f, 3) between the sensor and the points, of modal masses one."""
    w = 2 * np.pi * NATURAL_Hz
    s = s[:, None, None]
    return np.sum(s * SHAPE * SHAPE[0] / (s**2 + 2 * RATIO * w * s + w**2), axis=2)


def pulse(count, *, rebound=0.0):
    """A half sine from sample `PRE` on, and a weaker one 25 ms later."""
    t = (np.arange(count) - PRE) / RATE_Hz
    out = np.where((t >= 0) & (t < WIDTH_s), np.sin(np.pi * np.clip(t, 0, WIDTH_s) / WIDTH_s), 0.0)
    return PEAK_N * (out + rebound * np.roll(out, round(0.025 * RATE_Hz)))


def response(force, point):
    """Velocity at the sensor: the convolution with the impulse response, by modes."""
    t = np.arange(len(force)) / RATE_Hz
    w, z = 2 * np.pi * NATURAL_Hz, RATIO
    wd = w * np.sqrt(1 - z**2)
    decay = np.exp(-np.outer(t, z * w))
    h = decay * (np.cos(np.outer(t, wd)) - (z / np.sqrt(1 - z**2)) * np.sin(np.outer(t, wd)))
    return np.convolve(force, h @ (SHAPE[point] * SHAPE[0]))[: len(force)] / RATE_Hz


def hammered(*, points=3, hits=3, seconds=2.0, seed=0, force_noise=0.0, response_noise=1e-5, rebounds=(), loud=()):
    """A run of hits; those whose numbers, from 0, are in `rebounds` hit twice, in `loud` saturate the converter."""
    rng, count = np.random.default_rng(seed), round(seconds * RATE_Hz)
    forces, responses, steps = [], [], []
    for number in range(points * hits):
        force = pulse(count, rebound=0.3 if number in rebounds else 0.0) * (1 + 0.1 * rng.standard_normal())
        seen = response(force, number // hits) + response_noise * rng.standard_normal(count)
        if number in loud:
            force = np.minimum(force, 15.0)
        forces.append(force + force_noise * rng.standard_normal(count))
        responses.append(seen)
        place = {"sweep": "abc"[number // hits], "index": number % hits, "frequency_Hz": 0.0, "target_channel": "force"}
        at = round(number * count / RATE_Hz * 1e9)
        steps.append(Step(time_ns=at, target_amplitude=PEAK_N, state=StepState.MEASURING, **place))
    values = {name: np.concatenate(each).astype(np.float32) for name, each in (("force", forces), ("v", responses))}
    daq = DeviceSamples(
        device="daq", sample_rate_Hz=RATE_Hz, values=values, block_start=np.zeros(1, np.int64),
        block_time_ns=np.zeros(1, np.int64), overload={},
    )  # fmt: skip
    force_range = 15.0 if loud else 100.0
    channels = {
        "force": Channel(name="force", quantity="force", unit="N", range=force_range),
        "v": Channel(name="v", quantity="velocity", unit="m/s", range=10.0),
    }
    return Run(
        path="hits.mcap", info={}, channels=channels, devices={"daq": daq}, steps=tuple(steps), events=(),
        attachments={"procedure.toml": PROCEDURE},
    )  # fmt: skip
