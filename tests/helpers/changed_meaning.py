"""Valid runs whose meaning is changed by chance: units, order, scale, shift, truncation, repetition, labels, mixing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from faulty_runs import copied, filled, fitted, relabelled, retimed, scaled, stepped, swapped, thinned

from recordings.run import DeviceSamples, Run

__all__ = ["MUTATIONS", "mutated"]

Dice = np.random.Generator
Runs = dict[str, Run]

FACTORS = (1 / 9.80665, 9.80665, 4.4482216, 1 / 4.4482216, 1e3, 1e-3, 2 * np.pi, 2**0.5, 0.5, 2.0, -1.0, 0.0, 1e30)
QUANTITIES = (("acceleration", "m/s^2"), ("velocity", "m/s"), ("displacement", "m"), ("force", "N"), ("voltage", "V"))


def mutated(runs: Runs, dice: Dice, *, most: int = 3) -> tuple[Runs, list[str]]:
    """Up to so many changes, one after the other, each of one run or of all; and what they were."""
    told = []
    for _ in range(int(dice.integers(1, most + 1))):
        name = str(dice.choice(sorted(MUTATIONS)))
        change = MUTATIONS[name]
        if name == "mix":
            runs = _mixed(runs, dice)
        else:
            touched = list(runs) if dice.random() < 0.4 else [str(dice.choice(list(runs)))]
            seed = int(dice.integers(2**31))  # the same change of all of them
            runs = {n: change(run, np.random.default_rng(seed)) if n in touched else run for n, run in runs.items()}
            name += f" of {', '.join(touched)}"
        told.append(name)
    return runs, told


def _channel(run: Run, dice: Dice) -> str:
    return str(dice.choice([name for device in run.devices.values() for name in device.values]))


def _unit(run: Run, dice: Dice) -> Run:
    return scaled(run, **{_channel(run, dice): float(dice.choice(FACTORS))})


def _scale(run: Run, dice: Dice) -> Run:
    return scaled(run, **{_channel(run, dice): float(np.exp(3 * dice.standard_normal()))})


def _exchange(run: Run, dice: Dice) -> Run:
    return swapped(run, _channel(run, dice), _channel(run, dice))


def _copy(run: Run, dice: Dice) -> Run:
    return copied(run, _channel(run, dice), _channel(run, dice))


def _shift(run: Run, dice: Dice) -> Run:
    turns = dice.random()
    return filled(run, _channel(run, dice), lambda x: np.roll(x, int(turns * len(x))))


def _offset(run: Run, dice: Dice) -> Run:
    size = float(np.exp(5 * dice.standard_normal()))
    return filled(run, _channel(run, dice), lambda x: x + size)


def _hold(run: Run, dice: Dice) -> Run:
    begin, share = dice.random(2)
    value = float(dice.choice([0.0, np.nan, 1.0]))

    def change(x: np.ndarray) -> np.ndarray:
        first = int(begin * len(x))
        x[first : first + 1 + int(share * len(x))] = value
        return x

    return filled(run, _channel(run, dice), change)


def _wild(run: Run, dice: Dice) -> Run:
    place, value = dice.random(), float(dice.choice([1e3, -1e9, 1e38, np.inf, np.nan]))

    def change(x: np.ndarray) -> np.ndarray:
        x[int(place * (len(x) - 1))] = value
        return x

    return filled(run, _channel(run, dice), change)


def _noise(run: Run, dice: Dice) -> Run:
    return filled(run, _channel(run, dice), lambda x: dice.standard_normal(len(x)))


def _clip(run: Run, dice: Dice) -> Run:
    share = dice.random()
    return filled(run, _channel(run, dice), lambda x: np.clip(x, -share * np.nanmax(np.abs(x)), share))


def _truncate(run: Run, dice: Dice) -> Run:
    """Without what came after some step: its steps, its samples, or both."""
    kept = int(dice.integers(0, len(run.steps) + 1)) if run.steps else 0
    if dice.random() < 0.5:
        return replace(run, steps=run.steps[:kept])
    share = float(dice.random())

    def change(device: DeviceSamples) -> dict[str, Any]:
        length = max(1, int(share * len(device)))
        blocks = int(np.searchsorted(device.block_start, length))
        return {
            "values": {n: x[:length] for n, x in device.values.items()},
            "block_start": device.block_start[:blocks],
            "block_time_ns": device.block_time_ns[:blocks],
        }

    return fitted(run, change)


def _drop_steps(run: Run, dice: Dice) -> Run:
    return replace(run, steps=tuple(step for step in run.steps if dice.random() < 0.7))


def _repeat(run: Run, dice: Dice) -> Run:
    """The first samples again and again."""
    share = 0.05 + 0.5 * float(dice.random())
    return filled(run, _channel(run, dice), lambda x: np.resize(x[: max(1, int(share * len(x)))], len(x)))


def _label(run: Run, dice: Dice) -> Run:
    quantity, unit = QUANTITIES[int(dice.integers(len(QUANTITIES)))]
    fields = [
        {"quantity": quantity, "unit": unit}, {"position_m": float(dice.uniform(0, 1))}, {"position_m": None},
        {"direction": str(dice.choice(["-y", "+y"]))}, {"range": float(np.exp(5 * dice.standard_normal()))},
    ]  # fmt: skip
    name = str(dice.choice(list(run.channels)))
    return relabelled(run, name, **fields[int(dice.integers(len(fields)))])


def _about(run: Run, dice: Dice) -> Run:
    new = [{"rig": "another"}, {"preload_N": str(dice.choice(["540", "0", "-3", "1e9"]))}, {"stored": "settled"}]
    return replace(run, info={**run.info, **new[int(dice.integers(len(new)))]})


def _steps(run: Run, dice: Dice) -> Run:
    factor, which = float(np.exp(dice.standard_normal() * dice.choice([1e-3, 0.1, 3.0]))), int(dice.integers(5))
    target = str(dice.choice([*run.channels, "nothing", ""]))
    return stepped(
        run,
        lambda step: (
            {"frequency_Hz": step.frequency_Hz * factor}, {"target_amplitude": step.target_amplitude * factor},
            {"target_channel": target}, {"sweep": "all"}, {"index": 0},
        )[which],
    )  # fmt: skip


def _clock(run: Run, dice: Dice) -> Run:
    factor = float(dice.choice([1e-3, 1e3, 1.01, 0.5, 1e-9]))
    if dice.random() < 0.5:
        return retimed(run, factor)
    return fitted(run, lambda device: {"sample_rate_Hz": device.sample_rate_Hz * factor})


def _later(run: Run, dice: Dice) -> Run:
    moved_ns = int(dice.normal() * 10 ** float(dice.uniform(3, 12)))
    return stepped(run, lambda step: {"time_ns": max(0, step.time_ns + moved_ns)})


def _thin(run: Run, dice: Dice) -> Run:
    return thinned(run, int(dice.integers(2, 40)))


def _without_channel(run: Run, dice: Dice) -> Run:
    gone = _channel(run, dice)
    return fitted(run, lambda device: {"values": {n: x for n, x in device.values.items() if n != gone}})


def _mixed(runs: Runs, dice: Dice) -> Runs:
    """Runs exchanged, or one in place of another."""
    names = list(runs)
    sources = dice.permutation(names) if dice.random() < 0.5 else dice.choice(names, len(names))
    return {name: runs[str(source)] for name, source in zip(names, sources, strict=True)}


MUTATIONS: dict[str, Callable[[Run, Dice], Run]] = {
    "unit": _unit, "scale": _scale, "exchange": _exchange, "copy": _copy, "shift": _shift, "offset": _offset,
    "hold": _hold, "wild": _wild, "noise": _noise, "clip": _clip, "truncate": _truncate, "drop steps": _drop_steps,
    "repeat": _repeat, "label": _label, "about": _about, "steps": _steps, "clock": _clock, "later": _later,
    "thin": _thin, "without a channel": _without_channel, "mix": lambda run, dice: run,
}  # fmt: skip
