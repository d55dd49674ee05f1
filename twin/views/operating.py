"""How the rig moves at the top of each sweep, and what the joint carries then, as the fitted model has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.comparison import SweepComparison
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.prediction import Predictor
from twin.identify.sweeps import rows_by_sweep
from twin.structure.assembly import Structure
from twin.views.curves import Fitted, ModeShape

__all__ = ["Motion", "modal_motion", "operating_motions"]

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A harmonic motion of both beams and the layer between them; complex amplitudes, their phase that of the force's.

    Attributes
    ----------
    title : str
    unit : str
        Of all displacements, such as ``mm``.
    lower_x, upper_x : ndarray, (n,), (m,)
        Positions along the rig, m.
    lower, upper : ndarray, (n,), (m,)
        Deflections.
    layer_x, opening : ndarray, (r,)
        How the layer opens across.
    shear_x, slip : ndarray, (q,)
        How its faces slide along each other.
    peel_N, shear_N : complex
        Normal and shear force that the layer carries at its point that opens, or slips, most; 0 where no force drives.
    """

    title: str
    unit: str
    lower_x: Array
    upper_x: Array
    lower: Array
    upper: Array
    layer_x: Array
    opening: Array
    shear_x: Array
    slip: Array
    peel_N: complex = 0.0
    shear_N: complex = 0.0

    @property
    def widest(self) -> complex:
        """The opening of the point that opens most."""
        return complex(self.opening[np.argmax(np.abs(self.opening))])

    @property
    def farthest(self) -> complex:
        """The slip of the point that slips most."""
        return complex(self.slip[np.argmax(np.abs(self.slip))])


def modal_motion(shape: ModeShape) -> Motion:
    """A normal mode as a motion."""
    return Motion(
        title=f"Mode {shape.number}, {shape.frequency_Hz:.5g} Hz",
        unit="tip amplitude 1",
        lower_x=shape.lower_x,
        upper_x=shape.upper_x,
        lower=shape.lower,
        upper=shape.upper,
        layer_x=shape.layer_x,
        opening=shape.opening,
        shear_x=shape.shear_x,
        slip=shape.slip,
    )


def operating_motions(
    evidence: Evidence, model: Fitted, sweeps: Sequence[SweepComparison], *, extension: Extension | None = None
) -> list[Motion]:
    """The motion at the largest step of each sweep, mm.

    The layer's moduli are those of the fitted law at the measured amplitude, as in the fit itself.  What nonlinear
    causes add beside it (a stop, a slap, friction) acts on the fundamental here only as far as the law took it up.

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
    # The clamp's own motion is left out, and a sensor that sits elsewhere than believed moves no beam.
    acting = evidence.known.merged(extension or Extension())
    structural = replace(acting, output_offset_m={}, nonlinear=(), base_receptance=0.0)
    predictor = Predictor(replace(evidence, effects=()), structural)
    s, attached = predictor.model.structure, predictor.model.ports
    mesh, looked = s.mesh, _looked_at(s)
    predictor.model = predictor.model.with_ports(np.vstack([attached.rows[attached.extra], *looked]))
    cuts = np.cumsum([len(part) for part in looked])[:-1]
    rows = np.array([row for _, row in tops])
    X, time_s = predictor.amplitude_m[rows], steps.time_s[rows] - evidence.origin_s
    omega = predictor.clock(steps.omega[rows], time_s)
    base = model.unknowns.base
    dE, dG = predictor.moduli_changes(model.unknowns, X, time_s)
    R = predictor.receptance(omega, base, dE, dG)
    moved = R[:, attached.extra.stop :, attached.drive] * np.abs(steps.force[rows, :1])
    E, G = base.E * (1 + 1j * base.loss_E) + dE, base.G * (1 + 1j * base.loss_G) + dG
    motions = []
    for k, (name, row) in enumerate(tops):
        v, opening, slip = np.split(moved[k], cuts)
        widest, farthest = int(np.argmax(np.abs(opening))), int(np.argmax(np.abs(slip)))
        motions.append(
            Motion(
                title=f"{name}, {steps.omega[row] / (2 * np.pi):.5g} Hz",
                unit="mm",
                lower_x=mesh.lower_x,
                upper_x=mesh.upper_x,
                lower=1e3 * v[: len(mesh.lower_x)],
                upper=1e3 * v[len(mesh.lower_x) :],
                layer_x=s.layer_x,
                opening=1e3 * opening,
                shear_x=s.shear_x,
                slip=1e3 * slip,
                peel_N=complex(E[k] * s.normal_weight[widest] ** 2 * opening[widest]),
                shear_N=complex(G[k] * s.shear_weight[farthest] ** 2 * slip[farthest]),
            )
        )
    return motions


def _looked_at(s: Structure) -> tuple[Array, Array, Array]:
    """Rows of every node's deflection, of the layer's openings, and of its slips, all in m."""
    deflections = np.zeros((s.mesh.nodes, 3 * s.mesh.nodes))
    deflections[np.arange(s.mesh.nodes), 3 * np.arange(s.mesh.nodes) + 1] = 1.0
    return deflections[:, s.free], s.B_E / _column(s.normal_weight), s.B_G / _column(s.shear_weight)


def _column(values: Array) -> Array:
    return np.reshape(values, (-1, 1))
