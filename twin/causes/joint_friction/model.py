"""Micro-slip in the joint: a slider that sticks until its force is reached, then slips."""

from collections.abc import Callable
from typing import Any

import numpy as np

from twin.causes.joints import JointCause
from twin.diagnose.cause import Label, Labels, MeasuredData, Parameter, Values, thresholds
from twin.identify.jenkins import RIPPLES
from twin.identify.joint_motion import largest_motion
from twin.identify.linear.receptance import ModalBasis
from twin.identify.model_modification import Attachment, ModelModification, NonlinearForce
from twin.identify.slipping import Slider
from twin.structure import Structure, layer_points


class JointFriction(JointCause):
    """A Jenkins element on the slip of one of the layer's points."""

    name = "joint-friction"
    summary = "the joint sticks up to a force and slips beyond it"
    tried_at_full_size = True

    def labels(self, evidence: MeasuredData) -> Labels:
        """The elements of each joint's layer, counted from the clamp's end."""
        return tuple(
            {**label, "layer_element": str(n + 1)}
            for label in super().labels(evidence)
            for n in range(evidence.joints[self.number(evidence, label)].layer_elements)
        )

    def assumed(self, evidence: MeasuredData) -> Label:
        """The last element, as on the bench: other programs' rig files name none."""
        return self.labels(evidence)[-1]

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Stiffness while sticking, and the displacement at which slip begins.

        The displacement is sought instead of the force, which says nothing of amplitude before the stiffness is known.
        """
        joint = self.number(evidence, label)
        points = layer_points(evidence.model.structure, evidence.joints[joint].layer_elements, joint=joint)
        unit = float(evidence.model.reference_G[joint] * np.sum(points.slip_weight))
        # Slip of the point where the rig moves as far as was measured and its joint is linear, m.
        slip = float(largest_motion(evidence, joint)[1][int(label["layer_element"]) - 1])
        starts = thresholds(slip, least=0.05)
        return (
            Parameter(
                name="stiffness_N_per_m",
                scale=6 * unit,
                lower=0.0,
                upper=300 * unit,
                null=0.0,
                starts=(0.3 * unit,),
                model_error=0.12,
            ),
            Parameter(name="slip_m", scale=slip, lower=1e-3 * slip, upper=3 * slip, starts=starts, model_error=0.06),
        )

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Return the slip force in place of the displacement at which slip begins."""
        k, slip = values["stiffness_N_per_m"], values["slip_m"]
        spread = np.hypot(std.get("stiffness_N_per_m", 0.0) / max(k, 1e-300), std.get("slip_m", 0.0) / slip)
        return (
            {"stiffness_N_per_m": k, "slip_force_N": k * slip},
            {"stiffness_N_per_m": std.get("stiffness_N_per_m", 0.0), "slip_force_N": float(k * slip * spread)},
        )

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the displacement at which slip begins in place of the slip force."""
        k, force = values["stiffness_N_per_m"], values["slip_force_N"]
        return {"stiffness_N_per_m": k, "slip_m": force / max(k, 1e-300)}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The stuck spring everywhere, and what slipping takes off it."""
        slip = self._slip(evidence, label)
        k = values["stiffness_N_per_m"]
        slip_force = k * values["slip_m"]
        row = slip(evidence.model.structure)[None]
        stuck = Attachment(lambda s: slip(s)[None], lambda omega: np.full((len(omega), 1), k + 0j))
        slider = Slider(k, slip_force, _Ripple(evidence.model.basis, row))
        force = NonlinearForce(slip, slider.equivalent, slider.harmonics, slider=slider)
        return ModelModification(attachments=(stuck,), nonlinear=(force,))

    def _slip(self, evidence: MeasuredData, label: Label) -> Callable[[Structure], Any]:
        """Row of the point's slip, m."""
        joint, number = self.number(evidence, label), int(label["layer_element"]) - 1
        count = evidence.joints[joint].layer_elements
        return lambda structure: layer_points(structure, count, joint=joint).slip[number]


class _Ripple:
    """Compliance (f, 3) of a port at the ripples' frequencies; the same few are asked for again and again."""

    def __init__(self, basis: ModalBasis, row: Any) -> None:
        self._basis, self._row = basis, row
        self._omega, self._compliance = np.zeros(0), np.zeros((0, len(RIPPLES)), complex)

    def __call__(self, omega: Any) -> Any:
        at = np.searchsorted(self._omega, omega)
        if np.max(at, initial=0) == len(self._omega) or np.any(self._omega[at] != omega):
            self._omega = np.unique(np.concatenate([self._omega, omega]))
            found = [self._basis.receptance(self._row, h * self._omega)[:, 0, 0] for h in RIPPLES]
            self._compliance, at = np.stack(found, axis=1), np.searchsorted(self._omega, omega)
        return self._compliance[at]
