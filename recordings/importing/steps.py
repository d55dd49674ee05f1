"""What a test did, from its signals: sweeps of steps as a recording says them, or one broadband stretch."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from recordings.importing.dwells import Dwell, find_dwells
from recordings.quantities import follows_excitation, known_quantities
from recordings.run import DeviceSamples, Run, Step, StepState

LEAP = 8.0
"""A step of frequency that is so many times the sweep's usual one begins another sweep."""
OTHER_SIZE = 0.25
"""Relative change of the amplitude at which another sweep begins, where the frequency goes on."""


def found_steps(run: Run, excitation: str, target: str) -> tuple[tuple[Step, ...], list[str]]:
    """The steps of a run, and what is to be told of them.

    Parameters
    ----------
    run
        Without steps.
    excitation
        ``found``, ``stepped-sine`` or ``broadband``.
    target
        The channel that was held.
    """
    device = run.device_of(target)
    if excitation != "broadband":
        known = known_quantities()
        names = [name for name in device.values if follows_excitation(run.channels[name].quantity)]
        names.sort(key=lambda name: (name != target, not known[run.channels[name].quantity].drives))
        drives = sum(known[run.channels[name].quantity].drives for name in names)
        signals = [_filled(np.asarray(device.values[name])) for name in names]
        found = find_dwells(signals, device.sample_rate_Hz, followed=drives or len(names))
        if found is not None:
            dwells, place = found
            steps = tuple(_steps(device, dwells, names[place]))
            unsettled = sum(not each.still for each in dwells)
            notes = [f"{len(dwells)} steps found in {names[place]}"]
            notes += [f"{unsettled} steps had not settled when half of them was over"] if unsettled else []
            return steps, notes
        if excitation == "stepped-sine":
            raise ValueError("no steps of a stepped sine are found in it")
    values = _filled(np.asarray(device.values[target]))
    level = float(np.sqrt(np.mean((values - values.mean()) ** 2)))
    begun = Step(
        time_ns=int(device.block_time_ns[0]), sweep="broadband", index=0, frequency_Hz=0.0, target_channel=target,
        target_amplitude=level, state=StepState.MEASURING,
    )  # fmt: skip
    steps = (begun, replace(begun, time_ns=device.end_ns, state=StepState.DONE))
    return steps, ["taken as one broadband stretch"]


def _filled(values: np.ndarray) -> np.ndarray:
    """Lost samples as a straight line between their neighbours."""
    sound = np.isfinite(values)
    if not sound.any():
        return np.zeros(len(values))
    return np.interp(np.arange(len(values)), np.flatnonzero(sound), values[sound].astype(np.float64))


def _steps(device: DeviceSamples, dwells: Sequence[Dwell], target: str) -> Iterator[Step]:
    names: set[str] = set()
    for sweep in _sweeps(dwells):
        size = float(f"{np.median([each.size for each in sweep]):.3g}")
        name = _name(sweep, size, target, names)
        names.add(name)
        for index, each in enumerate(sweep):
            step = Step(
                time_ns=_time(device, each.settled), sweep=name, index=index, frequency_Hz=each.frequency_Hz,
                target_channel=target, target_amplitude=size, state=StepState.MEASURING,
            )  # fmt: skip
            if each.begin < each.settled:
                yield replace(step, time_ns=_time(device, each.begin), state=StepState.SETTLING)
            yield step
        yield replace(step, time_ns=_time(device, sweep[-1].end), state=StepState.DONE)


def _time(device: DeviceSamples, position: int) -> int:
    return int(device.times_ns(position, position + 1)[0]) if position < len(device) else device.end_ns


def _sweeps(dwells: Sequence[Dwell]) -> Iterator[list[Dwell]]:
    """Steps whose frequency goes one way, or whose amplitude does at one frequency."""
    sweep: list[Dwell] = []
    for each in dwells:
        if sweep and not _goes_on(sweep, each):
            yield sweep
            sweep = []
        sweep.append(each)
    if sweep:
        yield sweep


def _goes_on(sweep: list[Dwell], one: Dwell) -> bool:
    if len(sweep) < 2:
        return abs(math.log(one.size / sweep[-1].size)) < OTHER_SIZE
    usual = np.diff([math.log(each.frequency_Hz) for each in sweep])
    step = math.log(one.frequency_Hz / sweep[-1].frequency_Hz)
    same_size = abs(math.log(one.size / sweep[-1].size)) < OTHER_SIZE
    return bool(same_size and step * usual[-1] > 0 and abs(step) < LEAP * np.median(np.abs(usual)))


def _name(sweep: list[Dwell], size: float, target: str, taken: set[str]) -> str:
    way = "down" if sweep[-1].frequency_Hz < sweep[0].frequency_Hz else "up"
    base = f"{target}-{size:g}-{way}"
    tried = (base if number == 1 else f"{base}-{number}" for number in range(1, len(taken) + 2))
    return next(name for name in tried if name not in taken)
