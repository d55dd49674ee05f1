"""A rig updated to a modal table: measured natural frequencies with shapes at nodes of the lab's geometry."""

import numpy as np

from recordings.errors import InputError
from recordings.responses import FoundModes, Responses
from twin.arrays import Array
from twin.identify.estimate import Estimate
from twin.identify.modes.pairing import paired
from twin.identify.responses.limits import LIMITS
from twin.identify.responses.parameters import parameters_of
from twin.identify.responses.updating import (
    FrequencyPair,
    MatchedModes,
    Updated,
    applied,
    fit_parameters,
    mac,
    modes_of,
    told,
    with_damping,
    with_rest,
)
from twin.rigs import BeamPart, Place, Rig, preload_name

Where = list[tuple[int, int, Place]]
"""Rows of a shape, axes in it, and the rig's places."""


def update_to_modes(file: Responses, rig: Rig, *, preload: str | None = None, scatter: float | None = None) -> Updated:
    """Update a rig to a file's modes, paired by frequency and by shape where the file says where its nodes are.

    Parameters
    ----------
    scatter
        Relative standard deviation of a natural frequency from case to case.

    Raises
    ------
    InputError
        If no mode of the file is one of the rig's.
    """
    state = preload or preload_name(rig)
    known = scatter or rig.natural_frequencies.scatter or LIMITS.scatter
    rig = with_rest(rig, [], {}, known, known)
    where = _where(file, rig)
    parameters, measured = parameters_of(rig, state), [mode for mode in file.modes if mode.frequency_Hz > 0]
    before = modes_of(rig, state, [place for *_, place in where], count=LIMITS.looked_at)
    x, covariance, after = np.array([p.start for p in parameters]), np.zeros((len(parameters),) * 2), before
    for _ in range(LIMITS.modal_tables_rounds if parameters else 1):
        pairs = _pairs(measured, after, where)
        if not pairs:
            raise InputError(file.path, "data set 55", "none of its modes is near one of the rig's", "is it this rig?")
        numbers = np.array([number for number, _ in pairs])
        Hz = np.array([mode.frequency_Hz for _, mode in pairs])

        def misfit(trial: Rig, _: Array, numbers: Array = numbers, Hz: Array = Hz) -> Array:
            model = modes_of(trial, state, [], count=LIMITS.looked_at)
            return np.asarray(np.log(Hz / model.Hz[numbers]) / np.hypot(known, LIMITS.updating_model))

        if parameters:
            x, covariance = fit_parameters(rig, parameters, misfit, x)
        updated = applied(rig, parameters, x)
        after = modes_of(updated, state, [place for *_, place in where], count=LIMITS.looked_at)
    shown = tuple(
        FrequencyPair(
            number + 1, mode.frequency_Hz, float(before.Hz[number]), float(after.Hz[number]),
            *(_alike(mode, each, number, where) for each in (before, after)),
        )
        for number, mode in pairs
    )  # fmt: skip
    offsets = np.zeros(max(numbers) + 1)
    offsets[numbers] = ((Hz / after.Hz[numbers]) ** 2 - 1) / 2
    damping = {number + 1: Estimate(mode.damping_ratio, 0.0) for number, mode in pairs if 0 < mode.damping_ratio < 1}
    notes = [f"natural frequencies are taken to scatter by {100 * known:.2g} % from case to case"]
    if not where:
        notes.append("the file has no nodes on the rig's parts: modes are paired by frequency alone, without MAC")
    notes += [f"{m.frequency_Hz:.5g} Hz is no mode of the rig's" for m in measured if m not in [p for _, p in pairs]]
    return Updated(
        with_damping(with_rest(updated, offsets.tolist(), {}, known, known), damping), state, (file.path,),
        tuple(notes), known, told(parameters, x, covariance), shown, damping,
    )  # fmt: skip


def _where(file: Responses, rig: Rig) -> Where:
    """Places of the rig for the nodes and axes of the file's shapes."""
    layout = rig.layout()
    nodes = file.modes[0].nodes
    points = [file.nodes.get(int(node)) for node in nodes]
    found: Where = []
    size = max((beam.length for beam in layout.beams), default=0.0)
    for row, point in enumerate(points):
        if point is None:
            continue
        for beam in layout.beams:
            at, beside = _beside(beam, np.array(point))
            if beside <= LIMITS.near * size + beam.thickness and -1e-9 <= at <= beam.length + 1e-9:
                plane = not beam.in_space
                axes = range(2) if plane else range(3)
                found += [
                    (row, axis, Place(beam.name, min(max(at, 0.0), beam.length), tuple(np.eye(3)[axis].tolist())))
                    for axis in axes
                ]
                break
    return found


def _beside(beam: BeamPart, point: Array) -> tuple[float, float]:
    """Metres along a beam, and away from its axis."""
    start, axis = np.array([*beam.start, 0.0][:3]), np.array(beam.axis)
    at = float((point - start) @ axis)
    return at, float(np.linalg.norm(point - start - at * axis))


def _pairs(measured: list[FoundModes], model: MatchedModes, where: Where) -> list[tuple[int, FoundModes]]:
    """Each measured mode with the number of the model's that is most like it, each of those once."""
    alike = [[_alike(mode, model, number, where) or 1.0 for number in range(len(model.Hz))] for mode in measured]
    rows = paired(np.array([mode.frequency_Hz for mode in measured]), model.Hz, np.array(alike))
    return sorted(((column, measured[row]) for row, column in rows.items()), key=lambda pair: pair[0])


def _alike(mode: FoundModes, model: MatchedModes, number: int, where: Where) -> float | None:
    """MAC of a measured shape with the model's; None without two numbers to compare."""
    if len(where) < 2:
        return None
    measured = np.array([mode.shape[row, axis] for row, axis, _ in where])
    if not np.any(measured) or not np.any(model.constants[:, number]):
        return None
    return mac(measured, model.constants[:, number])
