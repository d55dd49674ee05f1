"""One Gauss-Newton step of the joint's law about three modes, beside finite differences on the full banded matrices.

Both find, at every step of the sweeps, the motion of the layer's points that goes with the law's stiffness at that very
motion and with the amplitude that the reference channel shows, and how the responses change with E', G', their losses
and every value of the law.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from benchmarks.equivalent_linear import in_bands
from benchmarks.measured import Measured, timed_in_turns
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import HARMONICS, MeasuredData, StepArrays
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import Whitening
from twin.rigs import load_rig, preload_name
from twin.structure import layer_points

Array = NDArray[Any]

MODES, LEVELS, STEPS = 3, (0.25, 0.5, 1.0), 41
LARGEST_M = (2e-3, 1e-4, 1e-5)
"""Amplitude at the tip of each mode's largest sweep."""
KNOTS = 20
LINEAR = 4
"""E', G' and their losses lead the unknowns; damping of modes has no place in the full matrices."""
CHANGE, COMPARED = 1e-4, 5
"""Of each unknown, and how many of them are compared."""
TURNS, RELAXATION = 40, 0.8
"""Of the full model's own balance, which goes by fixed point from where ours ended; it ends when it has settled."""
SETTLED = 1e-9


def gauss_newton_three_modes() -> Measured:
    """Three modes, three levels, 41 steps: residual and sensitivities to 44 unknowns."""
    evidence, baseline = _sweeps()
    free = ResidualModel(evidence)
    receptance = free.receptance(evidence.steps.omega, baseline.base, free.step_times, inner=False, points=True)
    found = free.local.balance(baseline.laws, evidence.steps.omega, free.surroundings(receptance, evidence.steps.omega))
    outputs = len(evidence.channels)
    factor = np.broadcast_to(np.eye(2 * outputs), (len(evidence.steps), 2 * outputs, 2 * outputs))
    held = Linearisation((), Whitening(np.array(factor)), found, None, baseline, None)
    residual_model = ResidualModel(evidence, held=held)
    # Residuals are those of measured over predicted: with the forces that are predicted, changes are of logarithms.
    R, omega, _ = residual_model.step_receptance(baseline, inner=False, held=found)
    evidence.steps.force[:, 0] = evidence.steps.response[:, 0, 0] / residual_model.responses(R, omega)[:, 0]
    full = _BandedRig(evidence, np.abs(found.motion))

    law = np.arange(len(baseline.blocks))[baseline.of_laws]
    columns, x = np.concatenate([np.arange(LINEAR), law]), baseline.vector

    def ours() -> Array:
        return residual_model.evaluate(baseline).jacobian[:, columns]

    def one() -> Array:
        return full.log_response(baseline)

    # Differences take as many responses as there are unknowns, and one: each is the same work.
    mine, other = timed_in_turns(ours, one, tries=1)
    other *= 1 + len(columns)
    J, at = ours(), one()
    unit = np.where(np.arange(len(columns)) < LINEAR, 1.0, baseline.base.E[0])
    errors = []
    for column in np.linspace(0, len(columns) - 1, COMPARED).astype(int):
        moved = x.copy()
        moved[columns[column]] += CHANGE * unit[column]
        difference = (full.log_response(baseline.with_vector(moved)) - at) / CHANGE
        errors.append(float(np.linalg.norm(J[:, column] * unit[column] - difference)))
    return Measured(
        ratio=other / mine, promise=100, against="finite differences on the banded full model",
        error=max(errors) / float(np.max(np.linalg.norm(J, axis=0) * unit)),
        more={"ms": 1e3 * mine, "steps": len(evidence.steps), "parameters": J.shape[1]},
    )  # fmt: skip


def _sweeps() -> tuple[MeasuredData, BaselineParameters]:
    """Sweeps of the steel rig whose tip moves as a resonance would make it; their forces are still to be predicted."""
    rig = load_rig("steel-lap-joint")
    outputs = (Output("acc2", "acceleration", rig.layout().place(rig.layout().length)),)
    model = build_linear_model(rig, list(outputs))
    base = replace(nominal_parameters(rig), loss_E=np.array([0.02]), loss_G=np.array([0.05]), zeta=np.full(5, 1e-12))
    shape = 1.0 / np.sqrt(1.0 + np.linspace(-4.0, 4.0, STEPS) ** 2)
    omega = np.concatenate(
        [w * np.tile(np.linspace(0.98, 1.01, STEPS), len(LEVELS)) for w in model.basis.omega[:MODES]]
    )
    tip = np.concatenate([level * most * shape for most in LARGEST_M for level in LEVELS])
    force, response = np.zeros((len(omega), HARMONICS), complex), np.zeros((len(omega), 1, HARMONICS), complex)
    force[:, 0], response[:, 0, 0] = 1.0, omega**2 * tip
    steps = StepArrays(
        omega, force, np.full(force.shape, 1e-8), response, np.full(response.shape, 1e-8), tip,
        np.zeros(len(omega)), np.zeros(len(omega)), np.zeros(len(omega)), (),
    )  # fmt: skip
    evidence = MeasuredData(
        rig=rig, preload=preload_name(rig), model=model, outputs=outputs, force="force", reference=0,
        broadband=(), steps=steps, unsettled=(), linear=None, runs=(), begun_s=0.0,
    )  # fmt: skip
    opening, slip = choose_knots(np.geomspace(1e-8, 1e-5, 50), KNOTS), choose_knots(np.geomspace(1e-8, 2e-6, 50), KNOTS)
    law = LayerLaw(opening, slip, 0.5 * base.E * opening / (opening + 1e-6), 4.0 * base.G * slip**2 / (slip**2 + 1e-12))
    return evidence, BaselineParameters(base, (law,))


class _BandedRig:
    """The rig's full matrices in bands, with what the law makes of the layer's points at each step."""

    def __init__(self, evidence: MeasuredData, amplitude: Array) -> None:
        model, self.steps = evidence.model, evidence.steps
        s = model.structure
        points = layer_points(s, evidence.rig.joints[0].layer_elements)
        local = [np.outer(row, row) * weight for row, weight in zip(points.rows, points.weights, strict=True)]
        bands, self.width, order = in_bands([s.stiffness(0.0, 0.0), s.joints[0].KE, s.joints[0].KG, s.M, *local])
        self.linear, self.local = bands[:4], bands[4:]
        self.load, self.read = (model.ports.rows[row][order] for row in (model.ports.drive, model.ports.outputs.start))
        self.points, self.start = points.rows[:, order], amplitude

    def log_response(self, baseline: BaselineParameters) -> Array:
        """Logarithms of the responses, real parts beside imaginary ones as the whitened residual has them."""
        base, (law,), p = baseline.base, baseline.laws, len(self.points) // 2
        omega, tip = self.steps.omega, self.steps.amplitude_m
        moduli = np.concatenate([[1.0], base.complex_E, base.complex_G])
        linear = np.tensordot(moduli, self.linear[:3], 1) - (omega**2)[:, None, None] * self.linear[3]
        amplitude, x = self.start, np.empty((len(omega), len(self.load)), complex)
        for _ in range(TURNS):
            k = np.hstack([-law.softening_at(amplitude[:, :p]) + 0j, 1j * law.loss_at(amplitude[:, p:])])
            for n, band in enumerate(linear + np.tensordot(k, self.local, 1)):
                x[n] = solve_banded((self.width, self.width), band, self.load, check_finite=False)
            answer = x @ self.read
            moved = np.abs(x @ self.points.T / answer[:, None]) * tip[:, None]
            if np.max(np.abs(moved / amplitude - 1)) < SETTLED:
                break
            amplitude = amplitude + RELAXATION * (moved - amplitude)
        H = np.log(-(omega**2) * answer)
        return np.column_stack([H.real, H.imag]).ravel()
