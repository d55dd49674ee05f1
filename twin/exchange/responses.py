"""Frequency responses of a run: H1 of broadband stretches, the ratio of the fundamentals of stepped sines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from recordings.quantities import QUANTITIES
from recordings.run import Channel, Run
from twin.identify.spectra.sine_fit import steady_states
from twin.identify.spectra.spectrum import broadband_records, h1

FRF_FORMS = {one.name: one.per_force for one in sorted(QUANTITIES, key=lambda one: one.derivative) if one.per_force}
"""Name of a response per force, by the response's quantity."""


@dataclass(frozen=True, kw_only=True)
class FrequencyResponses:
    """One column of the FRF matrix: all responses of one quantity to one force.

    The arguments of sdypy-EMA's ``Model``: ``Model(frf=r.frf, freq=r.frequency_Hz, frf_form=r.frf_form, ...)``.
    """

    sweep: str
    """Where in the run it was measured."""
    frequency_Hz: NDArray[np.float64]
    """Evenly spaced from 0 for broadband excitation; the steps, upward, for a stepped sine; (f,)."""
    frf: NDArray[np.complex128]
    """Complex response per force, in the response's unit per newton, as the channels measured it: a sensor whose
    direction is -y keeps its sign; (n, f)."""
    coherence: NDArray[np.float64] | None
    """Of broadband excitation, (n, f)."""
    responses: tuple[Channel, ...]
    force: Channel
    frf_form: str
    """``receptance``, ``mobility`` or ``accelerance``."""
    averages: int = 0
    """As many independent ones would be worth; 0 of stepped sines."""


def frequency_responses(run: Run, *, resolution_Hz: float = 0.1) -> list[FrequencyResponses]:
    """Frequency responses of every sweep of a run, in order of time.

    Parameters
    ----------
    run
        With one force channel, and at least one of displacement, velocity or acceleration.
    resolution_Hz
        Of broadband stretches: one over the length of the segments that are averaged, with a Hann window, which widens
        resonances narrower than a few of these.

    Raises
    ------
    InputError
        If the run has no such channels, or not one force, or no sweep over frequency.
    """
    forces = [channel for channel in run.channels.values() if channel.quantity == "force"]
    if len(forces) != 1:
        told = ", ".join(each.name for each in forces) or "none"
        raise InputError(run.path, "channels", f"one force is needed, there are {told}")
    responses = [channel for channel in run.channels.values() if channel.quantity in FRF_FORMS]
    if not responses:
        raise InputError(run.path, "channels", "no displacement, velocity or acceleration was recorded")
    found = [*_broadband(run, forces[0], responses, resolution_Hz), *_stepped(run, forces[0], responses)]
    if not found:
        raise InputError(run.path, "/procedure", "no broadband stretch and no sweep over frequency was measured")
    order = list(dict.fromkeys(step.sweep for step in run.steps))
    return sorted(found, key=lambda each: order.index(each.sweep))


def _by_form(responses: Sequence[Channel]) -> Iterator[tuple[str, tuple[Channel, ...]]]:
    for quantity, form in FRF_FORMS.items():
        if alike := tuple(channel for channel in responses if channel.quantity == quantity):
            yield form, alike


def _broadband(
    run: Run, force: Channel, responses: Sequence[Channel], resolution_Hz: float
) -> Iterator[FrequencyResponses]:
    names = [force.name, *(channel.name for channel in responses)]
    if not any(step.frequency_Hz == 0 for step in run.steps):
        return  # sines need not be sampled alike in all channels
    for record in broadband_records(run, channels=names):
        estimate = h1(record, force=force.name, resolution_Hz=resolution_Hz)
        for form, alike in _by_form(responses):
            frf = np.stack([estimate.H[each.name] for each in alike])
            coherence = np.stack([estimate.coherence[each.name] for each in alike])
            yield FrequencyResponses(
                sweep=record.sweep, frequency_Hz=estimate.frequency_Hz, frf=frf, coherence=coherence, responses=alike,
                force=force, frf_form=form, averages=estimate.averages,
            )  # fmt: skip


def _stepped(run: Run, force: Channel, responses: Sequence[Channel]) -> Iterator[FrequencyResponses]:
    names = [force.name, *(channel.name for channel in responses)]
    for sweep, steps in groupby(steady_states(run, channels=names), key=lambda state: state.sweep):
        upward = sorted(steps, key=lambda state: state.frequency_Hz)
        frequency = np.array([state.frequency_Hz for state in upward])
        if len(frequency) < 2 or np.any(np.diff(frequency) <= 0):
            continue  # a dwell or a ladder of amplitudes is no function of frequency
        for form, alike in _by_form(responses):
            force_N = np.array([state.amplitude[force.name][0] for state in upward])
            frf = np.stack([[state.amplitude[channel.name][0] for state in upward] for channel in alike]) / force_N
            yield FrequencyResponses(
                sweep=sweep, frequency_Hz=frequency, frf=frf, coherence=None, responses=alike, force=force,
                frf_form=form,
            )  # fmt: skip
