"""How the rig moves at the top of each sweep, and what its joints carry then, as the fitted model has it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.linear.structural_modification import update_receptance
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.residual_model import ResidualModel
from twin.structure import drawn_parts, layer_lines
from twin.views.curves import Fitted, modelled_by, sensor_places


@dataclass(frozen=True, kw_only=True, eq=False)
class JointMotion:
    """How a joint's layer moves, and what it carries."""

    name: str
    x: Array
    """Along the joint, m, (k,)."""
    opening: Array
    slip: Array
    """How it opens across, and how its faces slide along each other, (k,)."""
    widest: complex = 0.0
    farthest: complex = 0.0
    """Mean opening of the layer element that opens most, and mean slip of the one that slips most."""
    peel_N: complex = 0.0
    shear_N: complex = 0.0
    """Normal and shear force that these carry; 0, as their motion, where no force drives."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A harmonic motion of a rig; complex amplitudes, their phase that of the force's."""

    title: str
    unit: str
    """Of all displacements, such as ``mm``."""
    parts: tuple[Array, ...]
    """Displacement of the points that :func:`twin.structure.drawn_parts` gives of each part, (3, k)."""
    sensors: Array
    """Of the places of the sensors, (3, s)."""
    joints: tuple[JointMotion, ...]


def modal_motion(evidence: MeasuredData, model: Fitted) -> Motion:
    """The first mode as a motion, its largest displacement one."""
    s, modes = evidence.model.structure, modelled_by(evidence, model).modes
    parts = [part.rows @ modes.Phi[:, 0] for part in drawn_parts(s)]
    phi = modes.Phi[:, 0] / max(float(np.max(np.abs(part))) for part in parts)
    return Motion(
        title=f"mode 1, {modes.frequency_Hz[0]:.5g} Hz",
        unit="largest displacement 1",
        parts=tuple(part.rows @ phi for part in drawn_parts(s)),
        sensors=sensor_places(evidence).rows @ phi,
        joints=tuple(
            JointMotion(name=line.name, x=line.x, opening=line.opening @ phi, slip=line.slip @ phi)
            for line in layer_lines(s)
        ),
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
    sweeps
        Of this evidence; others are left out.
    """
    steps = evidence.steps
    rows_of = steps.by_sweep
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
    drawn, lines = [*drawn_parts(s), sensor_places(evidence, s)], layer_lines(s)
    looked = [*(part.rows.reshape(-1, len(s.M)) for part in drawn)]
    looked += [rows for line in lines for rows in (line.opening, line.slip)]
    first = len(structural.step_model.ports.outer)
    structural.step_model = structural.step_model.with_points(np.vstack(looked))
    drive = evidence.steps.drive[rows]
    R = structural.receptance(omega[rows], base, time_s, inner=False, points=True, drive=drive)
    R = update_receptance(R, structural.moving, balance.stiffness[rows])
    driven = R[:, :, structural.model.ports.drive] * force
    # What harmonics of the motion add is energy that goes to and fro between them and the fundamental, not a loop.
    by_law = (balance.stiffness - balance.more)[rows, : 2 * len(structural.points)]
    carried = [_carried(structural, n, base, time_s, by_law, driven) for n in range(len(lines))]
    motions = []
    for k, (name, row) in enumerate(tops):
        pieces = np.split(1e3 * driven[k, first:], np.cumsum([len(part) for part in looked])[:-1])
        *parts, sensors = (piece.reshape(3, -1) for piece in pieces[: len(drawn)])
        opening, slip = pieces[len(drawn) :: 2], pieces[len(drawn) + 1 :: 2]
        motions.append(
            Motion(
                title=f"{name}, {evidence.steps.omega[row] / (2 * np.pi):.5g} Hz",
                unit="mm",
                parts=tuple(parts),
                sensors=sensors,
                joints=tuple(
                    JointMotion(
                        name=line.name, x=line.x, opening=opening[n], slip=slip[n],
                        widest=complex(1e3 * carried[n][0][k, 0]), farthest=complex(1e3 * carried[n][0][k, 1]),
                        peel_N=complex(carried[n][1][k, 0]), shear_N=complex(carried[n][1][k, 1]),
                    )
                    for n, line in enumerate(lines)
                ),
            )
        )  # fmt: skip
    return motions


def _carried(
    rig: ForwardModel, joint: int, base: LinearParameters, time_s: Array, by_law: Array, driven: Array
) -> tuple[Array, Array]:
    """Motion (k, 2), m, of a joint's elements that open and slip most, and the forces (k, 2) that they carry, N.

    Parameters
    ----------
    by_law : ndarray, (k, 2 p)
        What the law adds to the stiffness of the layer's points, N/m.
    driven : ndarray, (k, q)
        Motion of all ports, m.
    """
    p = len(rig.points)
    dE, dG = rig.moduli_changes(base, time_s)
    of = rig.points.joint
    moduli = np.concatenate([(base.complex_E + dE)[:, of], (base.complex_G + dG)[:, of]], axis=1)
    stiffness = moduli * rig.points.weights + by_law
    motion = driven[:, rig.moving[: 2 * p]]
    size = np.where(np.tile(of == joint, 2), np.abs(motion), -1.0)
    most = np.stack([np.argmax(size[:, :p], axis=1), p + np.argmax(size[:, p:], axis=1)], axis=1)
    moved = np.take_along_axis(motion, most, axis=1)
    return moved, moved * np.take_along_axis(stiffness, most, axis=1)
