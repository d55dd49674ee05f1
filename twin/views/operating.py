"""How the rig moves at the top of each sweep, and what the joint carries then, as the fitted model has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.comparison import SweepComparison
from twin.identify.forward_model import ForwardModel
from twin.identify.linear_model import LinearParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.receptance import update_receptance
from twin.identify.residual_model import ResidualModel
from twin.identify.sweeps import rows_by_sweep
from twin.structure import beam_lines
from twin.views.curves import Deflection, Fitted, ModeShape, layer_begin

__all__ = ["Motion", "modal_motion", "operating_motions"]

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A harmonic motion of beams and the layer between them; complex amplitudes, their phase that of the force's.

    Attributes
    ----------
    title : str
    unit : str
        Of all displacements, such as ``mm``.
    beams : tuple of Deflection
    layer_x, opening : ndarray, (r,)
        How the layer opens across.
    shear_x, slip : ndarray, (q,)
        How its faces slide along each other.
    widest, farthest : complex
        Mean opening of the layer element that opens most, and mean slip of the one that slips most.
    peel_N, shear_N : complex
        Normal and shear force that these carry; 0, as their motion, where no force drives.
    """

    title: str
    unit: str
    beams: tuple[Deflection, ...]
    layer_x: Array
    opening: Array
    shear_x: Array
    slip: Array
    widest: complex = 0.0
    farthest: complex = 0.0
    peel_N: complex = 0.0
    shear_N: complex = 0.0


def modal_motion(shape: ModeShape) -> Motion:
    """A normal mode as a motion."""
    return Motion(
        title=f"Mode {shape.number}, {shape.frequency_Hz:.5g} Hz",
        unit="tip amplitude 1",
        beams=shape.beams,
        layer_x=shape.layer_x,
        opening=shape.opening,
        shear_x=shape.shear_x,
        slip=shape.slip,
    )


def operating_motions(
    evidence: MeasuredData,
    model: Fitted,
    sweeps: Sequence[SweepComparison],
    *,
    modification: ModelModification | None = None,
) -> list[Motion]:
    """The motion at the largest step of each sweep, mm.

    The layer has the fitted law's stiffness at each of its points, and nonlinear causes theirs, as in the fit itself.

    Parameters
    ----------
    evidence, model
        A fit.
    sweeps
        Of this evidence; others are left out.
    extension
        What the model adds to what is known of the rig.
    """
    steps = evidence.steps
    rows_of = rows_by_sweep(steps.states)
    size = np.abs(steps.response[:, evidence.reference, 0]) if len(steps) else np.zeros(0)
    tops = []
    for sweep in sweeps:
        inside = rows_of.get(sweep.sweep)
        if inside is not None and steps.states[inside[0]].run == sweep.run:
            tops.append((sweep.sweep, int(inside[np.argmax(size[inside])])))
    if not tops:
        return []
    fitted = ResidualModel(evidence, modification)
    _, omega, balance = fitted.step_receptance(model.baseline, inner=False)
    # The clamp's own motion is left out, and a sensor that sits elsewhere than assumed moves no beam.
    seen = replace(fitted.modification, output_offset_m={}, base_receptance=0.0)
    structural = ForwardModel(replace(evidence, effects=()), seen)
    s, base = structural.model.structure, model.baseline.base
    rows = np.array([row for _, row in tops])
    force, time_s = np.abs(evidence.steps.force[rows, :1]), structural.step_times[rows]
    lines, layer, begin = beam_lines(s), s.joints[0], layer_begin(s)
    looked = [
        *(line.rows for line in lines),
        layer.B_E / _column(layer.normal_weight),
        layer.B_G / _column(layer.shear_weight),
    ]
    first = len(structural.step_model.ports.rows)
    structural.step_model = structural.step_model.with_points(np.vstack(looked))
    R = structural.receptance(omega[rows], base, time_s, inner=False, points=True)
    R = update_receptance(R, structural.moving, balance.stiffness[rows])
    driven = R[:, :, structural.model.ports.drive] * force
    # What harmonics of the motion add is energy that goes to and fro between them and the fundamental, not a loop.
    by_law = (balance.stiffness - balance.more)[rows, : 2 * len(structural.points)]
    moved, carried = _carried(structural, base, time_s, by_law, driven)
    motions = []
    for k, (name, row) in enumerate(tops):
        parts = np.split(driven[k, first:], np.cumsum([len(part) for part in looked])[:-1])
        *deflections, opening, slip = parts
        motions.append(
            Motion(
                title=f"{name}, {evidence.steps.omega[row] / (2 * np.pi):.5g} Hz",
                unit="mm",
                beams=tuple(
                    Deflection(line.name, line.x, 1e3 * own) for line, own in zip(lines, deflections, strict=True)
                ),
                layer_x=begin + layer.normal_at,
                opening=1e3 * opening,
                shear_x=begin + layer.shear_at,
                slip=1e3 * slip,
                widest=complex(1e3 * moved[k, 0]),
                farthest=complex(1e3 * moved[k, 1]),
                peel_N=complex(carried[k, 0]),
                shear_N=complex(carried[k, 1]),
            )
        )
    return motions


def _carried(
    rig: ForwardModel, base: LinearParameters, time_s: Array, by_law: Array, driven: Array
) -> tuple[Array, Array]:
    """Motion (k, 2), m, of the elements that open and that slip most, and the forces (k, 2) that they carry, N.

    Parameters
    ----------
    by_law : ndarray, (k, 2 p)
        What the law adds to the stiffness of the layer's points, N/m.
    driven : ndarray, (k, q)
        Motion of all ports, m.
    """
    p = len(rig.points)
    dE, dG = rig.moduli_changes(base, time_s)
    joint = rig.points.joint
    moduli = np.concatenate([(base.complex_E + dE)[:, joint], (base.complex_G + dG)[:, joint]], axis=1)
    stiffness = moduli * rig.points.weights + by_law
    motion = driven[:, rig.moving[: 2 * p]]
    size = np.abs(motion)
    most = np.stack([np.argmax(size[:, :p], axis=1), p + np.argmax(size[:, p:], axis=1)], axis=1)
    moved = np.take_along_axis(motion, most, axis=1)
    return moved, moved * np.take_along_axis(stiffness, most, axis=1)


def _column(values: Array) -> Array:
    return np.reshape(values, (-1, 1))
