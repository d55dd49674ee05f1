"""Frequency responses of a run: H1 of broadband stretches, the ratio of the fundamentals of stepped sines.

As arrays, and as universal files: data set 58, function type 4, with the coherence as function type 6.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

from recordings.directions import axis_number
from recordings.errors import InputError
from recordings.quantities import QUANTITIES, quantity
from recordings.run import Channel, Run
from recordings.whole import refuse_existing, whole_file
from twin.arrays import Array
from twin.identify.spectra.sine_fit import steady_states
from twin.identify.spectra.spectrum import broadband_records, h1

_TEXT = 80
"""Longest line of text of a universal file."""
FRF_FORMS = {one.name: one.per_force for one in sorted(QUANTITIES, key=lambda one: one.derivative) if one.per_force}
"""Name of a response per force, by the response's quantity."""


@dataclass(frozen=True, kw_only=True)
class FrequencyResponses:
    """One column of the FRF matrix: all responses of one quantity to one force.

    The arguments of sdypy-EMA's ``Model``: ``Model(frf=r.frf, freq=r.frequency_Hz, frf_form=r.frf_form, ...)``.
    """

    sweep: str
    """Where in the run it was measured."""
    frequency_Hz: Array
    """Evenly spaced from 0 for broadband excitation; the steps, upward, for a stepped sine; (f,)."""
    frf: Array
    """Complex response per force, in the response's unit per newton, as the channels measured it: a sensor whose
    direction is -y keeps its sign; (n, f)."""
    coherence: Array | None
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
    for name, form in FRF_FORMS.items():
        if alike := tuple(channel for channel in responses if channel.quantity == name):
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


def write_universal(
    responses: Sequence[FrequencyResponses], path: str | Path, *, run: Run, overwrite: bool = False
) -> None:
    """Write frequency responses to a universal file, which appears whole or not at all.

    Nodes are the places of the run's channels in their order, from 1; directions are the nearest axes.  Values are in
    SI units, in binary with double precision.

    Raises
    ------
    InputError
        If the file exists, or cannot be written.
    """
    path = Path(path)
    refuse_existing(path, overwrite=overwrite)
    nodes = {name: node for node, name in enumerate(run.channels, start=1)}
    sets = [one for each in responses for one in _sets(each, nodes, run)]
    with whole_file(path) as part, warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves its file to be closed by Python
        pyuff.UFF(str(part)).write_sets(sets, mode="add")


# In data set 58 function 4 is a frequency response and 6 a coherence; 18 as a data type is a frequency.


def _sets(each: FrequencyResponses, nodes: dict[str, int], run: Run) -> list[dict[str, Any]]:
    found = []
    for row, channel in enumerate(each.responses):
        head = _head(each, channel, nodes, run)
        found.append({**head, **_axes(channel, each.force), "data": each.frf[row]})
        if each.coherence is not None:
            none = {"ordinate_spec_data_type": 0, "ordinate_axis_lab": "coherence", "orddenom_spec_data_type": 0}
            found.append({**head, **none, "func_type": 6, "data": each.coherence[row]})
    return found


def _head(each: FrequencyResponses, channel: Channel, nodes: dict[str, int], run: Run) -> dict[str, Any]:
    """What an FRF and its coherence share."""
    steps = np.diff(each.frequency_Hz)
    return {
        "type": 58, "binary": 1, "func_type": 4,
        "id1": f"{channel.name} / {each.force.name}"[:_TEXT], "id2": f"sweep {each.sweep}"[:_TEXT],
        "id3": run.info.get("started", "NONE")[:_TEXT], "id4": (run.info.get("rig") or "NONE")[:_TEXT],
        "id5": f"averages = {each.averages}" if each.averages else "NONE",
        "rsp_ent_name": _short(channel), "rsp_node": nodes[channel.name], "rsp_dir": axis_number(channel.direction),
        "ref_ent_name": _short(each.force), "ref_node": nodes[each.force.name],
        "ref_dir": axis_number(each.force.direction),
        "abscissa_spacing": int(np.allclose(steps, steps[0], rtol=1e-9)), "abscissa_spec_data_type": 18,
        "abscissa_axis_lab": "frequency", "abscissa_axis_units_lab": "Hz", "x": each.frequency_Hz,
    }  # fmt: skip


def _axes(channel: Channel, force: Channel) -> dict[str, Any]:
    return {
        "ordinate_spec_data_type": quantity(channel.quantity).uff, "ordinate_axis_lab": channel.quantity,
        "ordinate_axis_units_lab": channel.unit, "orddenom_spec_data_type": quantity(force.quantity).uff,
        "orddenom_axis_lab": force.quantity, "orddenom_axis_units_lab": force.unit,
    }  # fmt: skip


def _short(channel: Channel) -> str:
    return channel.name.encode("ascii", "replace")[:10].decode()
