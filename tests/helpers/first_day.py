"""Mistakes of a first day in a lab, and what a first look at the recordings is to say of each.

Each is put into a clean campaign of ``random``, ``sweeps`` and ``heldout``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from faulty_runs import copied, filled, fitted, relabelled, retimed, scaled, stepped, swapped, thinned

from recordings import Run
from recordings.run import Step
from twin.checks import FirstLook
from twin.checks.finding import Action

__all__ = ["MISTAKES", "NAMES", "PER_G", "Mistake", "Runs"]

Runs = Mapping[str, Run]
Change = Callable[[Run], Run]

NAMES = ("random", "sweeps", "heldout")
PER_G, PER_POUND, PER_FOOT = 1 / 9.80665, 1 / 4.4482216, 1 / 0.3048


@dataclass(frozen=True)
class Mistake:
    """What was done to which runs, and what is found.

    Attributes
    ----------
    kind, action
        Of the finding that names it.
    channel
        How the channel of that finding begins.
    said
        A part of what was found.
    runs
        Those that it was done to.
    """

    change: Change
    kind: str
    channel: str = ""
    said: str = ""
    action: Action = "stopped"
    runs: tuple[str, ...] = NAMES

    def put_into(self, runs: Runs) -> dict[str, Run]:
        """The campaign with it."""
        return {name: self.change(run) if name in self.runs else run for name, run in runs.items()}

    def assert_named(self, looked: FirstLook) -> None:
        """That it is named, and nothing of another kind before it."""
        first = looked.findings[0]
        assert (first.kind, first.action) == (self.kind, self.action), looked.told
        named = [one.found for one in looked.findings if one.kind == self.kind and one.channel.startswith(self.channel)]
        assert any(self.said in found for found in named), looked.told


RANDOM, SWEEPS, HELD_OUT = ("random",), ("sweeps",), ("heldout",)
SINES = (*SWEEPS, *HELD_OUT)


def _scaled(**factors: float) -> Change:
    return lambda run: scaled(run, **factors)


def _filled(channel: str, change: Callable[[np.ndarray], np.ndarray]) -> Change:
    return lambda run: filled(run, channel, change)


def _swapped(one: str, two: str) -> Change:
    return lambda run: swapped(run, one, two)


def _stepped(**changes: Callable[[Step], object]) -> Change:
    return lambda run: stepped(run, lambda step: {name: change(step) for name, change in changes.items()})


def _noise(run: Run) -> Run:
    rng = np.random.default_rng(list(run.path.encode()))
    for channel in run.channels:
        run = filled(run, channel, lambda x: rng.standard_normal(len(x)))
    return run


def _wild(channel: str, value: float) -> Change:
    return _filled(channel, lambda x: np.where(np.arange(len(x)) == len(x) // 2, value, x))


def _later_half(channel: str, value: float | None = None) -> Change:
    def change(x: np.ndarray) -> np.ndarray:
        middle = len(x) // 2
        return np.where(np.arange(len(x)) > middle, x[middle] if value is None else value, x)

    return _filled(channel, change)


def _every_other(channel: str) -> Change:
    """Zero in each second block of 64 samples."""
    return _filled(channel, lambda x: np.where(np.arange(len(x)) // 64 % 2, 0, x))


def _one_bin(run: Run) -> Run:
    """All steps with frequencies that are too high by the distance of the most common grid."""
    frequencies = [step.frequency_Hz for step in run.steps if step.frequency_Hz]
    grid = np.round(np.abs(np.diff(frequencies)), 6)
    apart = float(np.median(grid[grid > 0]))
    return stepped(run, lambda step: {"frequency_Hz": step.frequency_Hz + apart * (step.frequency_Hz > 0)})


def _from_list(order: Callable[[list[float]], list[float]]) -> Change:
    """The frequencies of each sweep's steps taken from a list in another order."""

    def change(run: Run) -> Run:
        lists: dict[str, list[float]] = {}
        for step in run.steps:
            frequencies = lists.setdefault(step.sweep, [])
            if step.frequency_Hz and step.frequency_Hz not in frequencies:
                frequencies.append(step.frequency_Hz)
        named = {sweep: dict(zip(frequencies, order(frequencies), strict=True)) for sweep, frequencies in lists.items()}
        return stepped(run, lambda step: {"frequency_Hz": named[step.sweep].get(step.frequency_Hz, 0.0)})

    return change


def _three_steps(run: Run) -> Run:
    """The middle ones of each sweep alone."""
    last = {step.sweep: step.index for step in run.steps}
    kept = [
        step
        for step in run.steps
        if step.state.name in ("DONE", "ABORTED") or abs(2 * step.index - last[step.sweep]) < 4
    ]
    return replace(run, steps=tuple(kept))


def _slower(run: Run) -> Run:
    """Rate and all time stamps wrong alike, by a thousand."""
    begun = min(int(device.block_time_ns[0]) for device in run.devices.values())
    slow = fitted(
        run,
        lambda device: {
            "sample_rate_Hz": device.sample_rate_Hz / 1000,
            "block_time_ns": begun + (device.block_time_ns - begun) * 1000,
        },
    )
    return stepped(slow, lambda step: {"time_ns": begun + max(0, step.time_ns - begun) * 1000})


def _renamed(run: Run) -> Run:
    names = {"acc1": "ACC"}
    whole = replace(run, channels={names.get(n, n): replace(c, name=names.get(n, n)) for n, c in run.channels.items()})
    return fitted(whole, lambda device: {"values": {names.get(n, n): x for n, x in device.values.items()}})


def _about(**fields: str) -> Change:
    return lambda run: replace(run, info={**run.info, **fields})


def _wrapped(x: np.ndarray) -> np.ndarray:
    """Whole numbers that overflow at half of their largest."""
    limit = 0.5 * float(np.max(np.abs(x)))
    return (x + limit) % (2 * limit) - limit


def _integrated(channel: str) -> Change:
    """Velocity for acceleration, by the rectangle rule without its drift."""

    def change(run: Run) -> Run:
        rate = run.device_of(channel).sample_rate_Hz
        return filled(run, channel, lambda x: np.cumsum(x - np.mean(x)) / rate)

    return change


MISTAKES: dict[str, Mistake] = {
    "acc1 in g": Mistake(_scaled(acc1=PER_G), "unit", "acc1", "in g"),
    "both in g": Mistake(_scaled(acc1=PER_G, acc2=PER_G), "unit", "acc1, acc2", "in g"),
    "force in lbf": Mistake(_scaled(force=PER_POUND), "unit", "force", "lbf"),
    "lbf and g": Mistake(_scaled(force=PER_POUND, acc1=PER_G, acc2=PER_G), "unit", "force", "lbf"),
    "force in kgf": Mistake(_scaled(force=PER_G), "unit", "force", "kgf"),
    "both in feet": Mistake(_scaled(acc1=PER_FOOT, acc2=PER_FOOT), "unit", "acc1, acc2", "feet"),
    "milli-units in one run": Mistake(_scaled(acc2=1e3), "unit", "acc2", "1000", runs=SWEEPS),
    "half": Mistake(_scaled(acc2=0.5), "unit", "acc2", "0.5"),
    "peak for rms": Mistake(_scaled(acc2=2**0.5), "unit", "acc2", "sqrt 2"),
    "hertz for rad/s": Mistake(_scaled(acc1=2 * np.pi), "unit", "acc1", "2 pi"),
    "fifty times": Mistake(_scaled(acc1=50.0), "unit", "acc1", "no unit"),
    "targets in rms": Mistake(
        _stepped(target_amplitude=lambda s: s.target_amplitude / 2**0.5), "unit", "force", "sqrt 2", runs=SINES
    ),
    "targets from peak to peak": Mistake(
        _stepped(target_amplitude=lambda s: s.target_amplitude * 2), "unit", "force", "0.5", runs=SINES
    ),
    "raw counts of 16 bits": Mistake(_scaled(acc1=32768 / 490, acc2=32768 / 490), "unit", "acc1, acc2", "times"),
    "amplifier at 10": Mistake(_scaled(acc2=10.0), "unit", "acc2", "9.81"),
    "amplifier at 0.1 in one run": Mistake(_scaled(acc1=0.1), "unit", "acc1", "9.81", runs=HELD_OUT),
    "accelerometers swapped": Mistake(_swapped("acc1", "acc2"), "swapped", "", "acc1 is acc2"),
    "accelerometers swapped in one run": Mistake(
        _swapped("acc1", "acc2"), "swapped", "", "acc1 is acc2", runs=HELD_OUT
    ),
    "force and acc1 swapped": Mistake(_swapped("force", "acc1"), "swapped", "force", "acc1"),
    "force and acc1 swapped in one run": Mistake(_swapped("force", "acc1"), "swapped", "force", "acc1", runs=HELD_OUT),
    "both turned": Mistake(_scaled(acc1=-1, acc2=-1), "direction", "force", "turned"),
    "turned in one run": Mistake(_scaled(acc1=-1), "direction", "acc1", "every", runs=SWEEPS),
    "force cell turned in one run": Mistake(_scaled(force=-1), "direction", "force", "turned", runs=SWEEPS),
    "one turned": Mistake(_scaled(acc1=-1), "direction", "acc1", "acc1 turned", "told"),
    "force zero": Mistake(_filled("force", np.zeros_like), "dead", "force", "is 0"),
    "force half zero": Mistake(_later_half("force", 0.0), "empty", "force", "zero"),
    "acc1 zero": Mistake(_filled("acc1", np.zeros_like), "dead", "acc1", "is 0", "set aside"),
    "acc1 no numbers": Mistake(
        _filled("acc1", lambda x: np.full_like(x, np.nan)), "dead", "acc1", "no sample", "set aside"
    ),
    "acc1 half zero": Mistake(_later_half("acc1", 0.0), "empty", "acc1", "zero", "set aside"),
    "acc1 half zero in turns": Mistake(_every_other("acc1"), "empty", "acc1", "zero", "set aside"),
    "acc1 stuck": Mistake(_later_half("acc1"), "empty", "acc1", "before", "set aside"),
    **{
        f"{value:g} in {channel} of {which}": Mistake(
            _wild(channel, value), "wild", channel, "wild sample", "set aside", (which,)
        )
        for value in (1e3, -1e3, 1e38)
        for which in ("random", "sweeps")
        for channel in ("force", "acc1")
    },
    "a velocity by its label": Mistake(
        lambda run: relabelled(run, "acc1", quantity="velocity", unit="m/s"), "quantity", "acc1", "velocity"
    ),
    "a velocity without its label": Mistake(_integrated("acc1"), "quantity", "acc1", "velocity"),
    "time stamps in ms": Mistake(lambda run: retimed(run, 1e-3), "clock", "", "0.001"),
    "steps in another unit of time": Mistake(
        _stepped(time_ns=lambda s: s.time_ns // 1000), "clock", "", "without samples"
    ),
    "rate a thousand times": Mistake(
        lambda run: fitted(run, lambda d: {"sample_rate_Hz": 1000 * d.sample_rate_Hz}), "clock", "", "1000"
    ),
    "rate and stamps": Mistake(_slower, "clock", "force", "0.001", runs=SINES),
    "rate off by two per cent": Mistake(
        lambda run: fitted(run, lambda d: {"sample_rate_Hz": 1.02 * d.sample_rate_Hz}), "clock", "", "1.02"
    ),
    "steps in rad/s": Mistake(
        _stepped(frequency_Hz=lambda s: s.frequency_Hz * 2 * np.pi), "clock", "force", "0.159", runs=SINES
    ),
    "steps one bin off": Mistake(_one_bin, "step", "force", "one step", runs=SINES),
    "steps of the next one": Mistake(
        _from_list(lambda f: [*f[1:], 2 * f[-1] - f[-2]]), "step", "force", "one step", runs=SINES
    ),
    "a sweep down, logged as up": Mistake(_from_list(lambda f: f[::-1]), "step", "force", "other order", runs=SINES),
    "steps logged half a step late": Mistake(
        _stepped(time_ns=lambda s: max(0, s.time_ns + 600_000_000)), "step", "force", "", runs=SINES
    ),
    "three steps a sweep": Mistake(_three_steps, "few", "", "has 3", "told", SINES),
    "force of another time": Mistake(
        _filled("force", lambda x: np.roll(x, len(x) // 3)), "unrelated", "acc1", "coherence", runs=RANDOM
    ),
    "acc1 rectified": Mistake(_filled("acc1", np.abs), "unrelated", "acc1", "coherence"),
    "acc1 overflows": Mistake(_filled("acc1", _wrapped), "overflow", "acc1", "jumps", "set aside"),
    "noise for sines": Mistake(_noise, "unrelated", "force", "power", runs=SWEEPS),
    "noise for all": Mistake(_noise, "unrelated", "acc1", "coherence"),
    "a channel's copy": Mistake(lambda run: copied(run, "acc2", "acc1"), "same", "acc2", "acc1", runs=SWEEPS),
    "no filter": Mistake(lambda run: thinned(run, 4), "aliasing", "force", "anti-aliasing", "told", RANDOM),
    "position": Mistake(lambda run: relabelled(run, "acc1", position_m=0.2), "position", "acc1", "0.2 m", "told"),
    "position in mm": Mistake(
        lambda run: relabelled(run, "acc1", position_m=300.0), "position", "acc1", "300 m", "told"
    ),
    "target": Mistake(_stepped(target_channel=lambda _: "acc1"), "target", "acc1", "force keeps", "told", SINES),
    "a range in V": Mistake(lambda run: relabelled(run, "acc1", range=0.001), "range", "acc1", "no use", "told"),
    "another rig's name": Mistake(_about(rig="other"), "rig", "", "other", "told"),
    "another name": Mistake(_renamed, "name", "acc1", "the file has ACC", "told"),
    "noise of another week": Mistake(
        _about(started="2026-02-07T09:00:00Z"), "specimen", "", "days before the others", "told", RANDOM
    ),
    "another preload": Mistake(_about(preload_N="540"), "preload", "", "resonances of 120N", "told"),
}
