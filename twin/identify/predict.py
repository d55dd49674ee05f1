"""Responses of an identified rig: the force for a given acceleration, or every acceleration that a force may give.

At an amplitude X the layer's moduli are E'(X), G'(X), and the rig is linear: the force that holds X at a frequency is
F = A / |H(omega, X)|, with A = omega_1^2 X the acceleration that belongs to X.  It is a function of X, and its
crossings of a given force are all the steady states at that force.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from twin.identify.evidence import Evidence, StepArrays
from twin.identify.layer_response import LayerResponse, layer_response
from twin.identify.linear_model import Output, believed_parameters, build_linear_model
from twin.identify.modal_prediction import ModalResponse
from twin.identify.prediction import Predictor
from twin.identify.whitening import COMMON_ERROR, LAW_ERROR, RATIO_ERROR
from twin.rigs import Rig

__all__ = ["RigResponse", "blank_evidence"]

Array = NDArray[Any]

GRID_POINTS = 240
SMALLEST = 1e-4
"""Least amplitude of the search beside the largest; below it the rig is linear."""
ROOT = 1e-10
"""Of the logarithm of value over target."""
CHUNK = 4096
NEAR = 0.1
"""How near to its target, as a logarithm, a curve that turns is looked at more closely."""
TURNS, HALVINGS = 30, 60
"""Of the bracketed search for a root; and halvings of the bracket of those that it has not found by then."""
FIXED_TURNS, FIXED = 120, 1e-9
"""Of the fixed point for nonlinear forces, and the relative change of their amplitudes at which it is one."""


def blank_evidence(rig: Rig, preload: str | None = None) -> Evidence:
    """A rig with all its response channels and nothing measured: what a prediction stands on."""
    outputs = tuple(Output(s.channel, s.quantity, s.position) for s in rig.response_sensors)
    nothing = np.zeros(0)
    none = np.zeros((0, len(outputs), 1))
    steps = StepArrays(nothing, none[:, 0], none[:, 0], none, none, nothing, nothing, nothing, ())
    return Evidence(
        rig=rig,
        preload=rig.preload_name(preload),
        model=build_linear_model(rig, list(outputs), preload=preload),
        outputs=outputs,
        force=rig.force_sensor.channel,
        reference=int(np.argmax([output.position_m for output in outputs])),
        broadband=(),
        steps=steps,
        unsettled=(),
        linear=None,
        runs=(),
    )


@dataclass(frozen=True)
class _Law:
    """E' and G' over X with their standard deviations; nothing where a rig has no law."""

    softening: Any
    loss: Any
    E_std: Any
    loss_std: Any
    largest: float

    @staticmethod
    def of(rig: Rig) -> _Law:
        table = rig.joint.law
        if table is None:
            return _Law(np.zeros_like, np.zeros_like, np.zeros_like, np.zeros_like, 1e-3)
        X = np.array(table.amplitude_m)

        def curve(values: list[float]) -> Any:
            smooth = PchipInterpolator(X, values if values else np.zeros(len(X)))
            return lambda x: smooth(np.clip(x, X[0], X[-1]))

        fields = (table.softening, table.loss, table.softening_std, table.loss_std)
        softening, loss, E_std, loss_std = map(curve, fields)
        return _Law(softening, loss, E_std, loss_std, float(X[-1]))


@dataclass(frozen=True)
class _State:
    """Steady states: acceleration per force, the force and the acceleration, and the former's relative std."""

    accelerance: Array
    force: Array
    acceleration: Array
    relative_std: Array


class RigResponse:
    """Predicts the response of a rig at the law's channel, the response sensor nearest the tip where it has no law.

    Parameters
    ----------
    evidence
        As from :func:`blank_evidence`.
    """

    def __init__(self, evidence: Evidence) -> None:
        rig = evidence.rig
        self._predictor = Predictor(evidence)
        self._law = _Law.of(rig)
        self._base = believed_parameters(rig, evidence.preload)
        names = evidence.channels
        table = rig.joint.law
        self.channel = table.channel if table is not None else names[evidence.reference]
        self._at = names.index(self.channel)
        self._power = {"displacement": 0, "velocity": 1, "acceleration": 2}[evidence.outputs[self._at].quantity]
        self._omega_1 = evidence.reference_omega

    def held(self, frequency_Hz: Array, acceleration_m_per_s2: Array) -> ModalResponse:
        """The forces that hold given acceleration amplitudes; `std` is the force's."""
        f, A = np.asarray(frequency_Hz, float), np.asarray(acceleration_m_per_s2, float)
        layer, row, steps, X = self._solutions(f, A, "acceleration")
        state = self._state(layer.pick(row[steps]), X)
        stable = self._slope(layer.pick(row[steps]), X, "force") > 0
        std = state.relative_std * state.force
        phase, branch = np.angle(-state.accelerance), _branches(steps)
        return ModalResponse(steps, f[steps], state.force, A[steps], std, phase, branch, stable)

    def forced(self, frequency_Hz: Array, force_N: Array) -> ModalResponse:
        """Every steady acceleration that given force amplitudes can hold, branch by branch; `std` is its own."""
        f, F = np.asarray(frequency_Hz, float), np.asarray(force_N, float)
        layer, row, steps, X = self._solutions(f, F, "force")
        found = layer.pick(row[steps])
        state = self._state(found, X)
        slope = self._slope(found, X, "force")
        with np.errstate(divide="ignore"):
            std = np.minimum(state.relative_std / np.abs(slope), 1.0) * state.acceleration
        phase, branch = np.angle(-state.accelerance), _branches(steps)
        return ModalResponse(steps, f[steps], F[steps], state.acceleration, std, phase, branch, slope > 0)

    def _solutions(self, f: Array, target: Array, what: str) -> tuple[LayerResponse, Array, Array, Array]:
        """All X at which a quantity has its target: the distinct frequencies' layer, rows in it, steps, X."""
        distinct, row = np.unique(f, return_inverse=True)
        omega = 2 * np.pi * distinct
        layer = layer_response(self._predictor, self._base, omega, np.zeros(len(omega)))
        last = np.full(len(distinct), self._law.largest)
        most = np.zeros(len(distinct))
        np.maximum.at(most, row, target)
        # Beyond the law's last knot the rig is linear, so that no solution lies above this one.
        top = last * np.maximum(1.3, 1.2 * most / self._value(layer, last, what))
        grid = top[:, None] * np.geomspace(SMALLEST, 1.0, GRID_POINTS)
        across = np.repeat(np.arange(len(distinct)), GRID_POINTS)
        values = self._value(layer.pick(across), grid.ravel(), what).reshape(grid.shape)
        at, low, high = [], [], []
        linear: list[tuple[int, float]] = []
        for i, r in enumerate(row):
            excess = np.log(values[r] / target[i])
            if excess[0] >= 0:
                linear.append((i, grid[r, 0] * np.exp(-excess[0])))
            points, excess = self._with_extrema(layer, r, grid[r], excess, target[i], what)
            for j in np.flatnonzero(np.signbit(excess[:-1]) != np.signbit(excess[1:])):
                at.append(i)
                low.append(points[j])
                high.append(points[j + 1])
        steps = np.array(at, int)
        X = np.zeros(0)
        if at:
            X = self._root(layer.pick(row[steps]), target[steps], np.log(low), np.log(high), what)
        steps = np.concatenate([np.array([i for i, _ in linear], int), steps])
        X = np.concatenate([[x for _, x in linear], X])
        order = np.lexsort((X, steps))
        return layer, row, steps[order], X[order]

    def _with_extrema(
        self, layer: LayerResponse, r: int, grid: Array, excess: Array, target: float, what: str
    ) -> tuple[Array, Array]:
        """The grid with points added where the curve turns without crossing zero between grid points."""
        turn = np.flatnonzero(np.diff(excess)[:-1] * np.diff(excess)[1:] < 0) + 1
        turn = turn[
            (np.abs(excess[turn]) < np.abs(excess[turn - 1])) & (np.abs(excess[turn]) < np.abs(excess[turn + 1]))
        ]
        turn = turn[np.abs(excess[turn]) < NEAR]
        if not len(turn):
            return grid, excess
        y0, y1, y2 = excess[turn - 1], excess[turn], excess[turn + 1]
        shift = 0.5 * (y0 - y2) / (y0 - 2 * y1 + y2)
        X = grid[turn] * (grid[1] / grid[0]) ** shift
        values = np.log(self._value(layer.pick(np.full(len(X), r)), X, what) / target)
        points, all_values = np.concatenate([grid, X]), np.concatenate([excess, values])
        order = np.argsort(points)
        return points[order], all_values[order]

    def _root(self, layer: LayerResponse, target: Array, a: Array, b: Array, what: str) -> Array:
        """Roots of log(value / target) over log X between a and b, by the Illinois variant of false position.

        Where this takes too long, as over a kink, the bracket is halved until nothing is left of it.
        """
        fa, fb = (np.log(self._value(layer, np.exp(x), what) / target) for x in (a, b))
        for turn in range(TURNS + HALVINGS):
            with np.errstate(invalid="ignore", divide="ignore"):
                c = np.where(fa == fb, a, b - fb * (b - a) / (fb - fa))
            if turn >= TURNS:
                c = np.where(np.abs(fb) < ROOT, b, 0.5 * (a + b))
            fc = np.log(self._value(layer, np.exp(c), what) / target)
            crossed = np.signbit(fc) != np.signbit(fb)
            a, fa = np.where(crossed, b, a), np.where(crossed, fb, 0.5 * fa)
            b, fb = c, fc
            if np.max(np.abs(fc)) < ROOT:
                break
        return np.asarray(np.exp(b))

    def _value(self, layer: LayerResponse, X: Array, what: str) -> Array:
        state = self._state(layer, X)
        return state.force if what == "force" else state.acceleration

    def _slope(self, layer: LayerResponse, X: Array, what: str) -> Array:
        """Slope of the logarithms over each other; that of the force is negative between two folds."""
        step = 1e-4
        up, down = (self._value(layer, X * np.exp(sign * step), what) for sign in (1, -1))
        return np.asarray(np.log(up / down) / (2 * step))

    def _state(self, layer: LayerResponse, X: Array) -> _State:
        pieces = [
            self._chunk(layer.pick(np.arange(k, min(k + CHUNK, len(X)))), X[k : k + CHUNK])
            for k in range(0, max(len(X), 1), CHUNK)
        ]
        return _State(*(np.concatenate(column) for column in zip(*pieces, strict=True)))

    def _chunk(self, layer: LayerResponse, X: Array) -> tuple[Array, Array, Array, Array]:
        softening = self._law.softening(X)
        dE, dG = -softening + 0j, 1j * self._law.loss(X)
        layer = self._with_nonlinear(layer, X, dE, dG)
        H, by_E, by_G = layer.responses(dE, dG)
        by_modulus, by_loss = by_E[:, self._at].real, (1j * by_G[:, self._at]).real
        E_std = np.hypot(self._law.E_std(X), LAW_ERROR * softening)
        loss_std = np.hypot(self._law.loss_std(X), LAW_ERROR * self._law.loss(X))
        model = COMMON_ERROR**2 + RATIO_ERROR**2
        relative = np.sqrt((by_modulus * E_std) ** 2 + (by_loss * loss_std) ** 2 + model)
        accelerance = self._accelerance(layer, H)
        force = X / self._amplitude_per_force(accelerance)
        return accelerance, force, force * np.abs(accelerance), relative

    def _accelerance(self, layer: LayerResponse, H: Array) -> Array:
        return np.asarray(H[:, self._at] * (1j * layer.omega) ** (2 - self._power))

    def _amplitude_per_force(self, accelerance: Array) -> Array:
        """The law's argument X for a unit force."""
        return np.abs(accelerance) / self._omega_1**2

    def _with_nonlinear(self, layer: LayerResponse, X: Array, dE: Array, dG: Array) -> LayerResponse:
        """Equivalent stiffness of the extension's nonlinear forces, their own amplitudes in step with X."""
        if not self._predictor.extension.nonlinear:
            return layer
        ports = self._predictor.nonlinear_ports
        updated = layer
        amplitude: Any = 0.0
        for turn in range(FIXED_TURNS):
            force = X / self._amplitude_per_force(self._accelerance(layer, updated.responses(dE, dG)[0]))
            new = np.abs(updated.drive_receptance(dE, dG, ports)) * force[:, None]
            change = np.abs(new - amplitude)
            if np.all(change <= FIXED * new):
                break
            # Half steps: a stiffness that grows with amplitude would else overshoot for ever.
            amplitude = new if turn == 0 else 0.5 * (amplitude + new)
            updated = layer.with_stiffness(ports, self._predictor.local.stiffness(amplitude, layer.omega))
        else:
            unsettled = np.any(change > FIXED * new, axis=1)
            worst = int(np.argmax(np.max(change / np.maximum(new, 1e-300), axis=1)))
            warnings.warn(
                f"the local forces of {unsettled.sum()} of {len(X)} states did not settle in {FIXED_TURNS} turns, "
                f"the worst by {np.max(change[worst] / new[worst]):.1g} at {X[worst]:.3g} m and "
                f"{layer.omega[worst] / (2 * np.pi):.5g} Hz",
                RuntimeWarning,
                stacklevel=2,
            )
        return updated


def _branches(steps: Array) -> Array:
    """Number of each solution within its step; equal steps stand together."""
    first = np.searchsorted(steps, steps)
    return np.arange(len(steps)) - first
