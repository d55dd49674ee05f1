"""A stop that the structure strikes on one side once it moves far enough."""

from typing import Any

import numpy as np
from scipy.stats import norm

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values, thresholds
from twin.diagnose.one_sided import one_sided_harmonics
from twin.diagnose.places import place_at, place_labels, position, single_point
from twin.identify.model_modification import ModelModification, NoiseMotion, NonlinearForce


class GroundStop(Cause):
    """f = k (v - gap) while v > gap."""

    name = "ground-stop"
    summary = "the structure touches a stop on one side of its motion"
    labels = staticmethod(place_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Stiffness, gap and place."""
        largest = max(float(np.max(evidence.steps.amplitude_m, initial=0.0)), 1e-5)
        gaps = thresholds(largest, least=0.2)
        return (
            # Stops may be a bolt's head or a cable's foam; the softest makes harmonics that nothing else does.
            Parameter(
                name="stiffness_N_per_m", scale=2e4, lower=0.0, upper=1e7, null=0.0, starts=(200.0,), tolerance=1e-5
            ),
            Parameter(name="gap_m", scale=largest, lower=0.005 * largest, upper=2 * largest, starts=gaps),
            *position(evidence, label, 5),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A local one-sided spring."""
        k, gap = values["stiffness_N_per_m"], values["gap_m"]

        def harmonics(a: Any, count: int, omega: Any) -> Any:
            return k * one_sided_harmonics(a, gap, count)

        def equivalent(a: Any, omega: Any) -> Any:
            return k * one_sided_harmonics(a, gap, 1)[:, 0] / np.maximum(a, 1e-12)

        def random(motion: NoiseMotion, omega: Any) -> Any:
            return np.full(len(omega), k * norm.sf(gap / max(motion.displacement, 1e-12)) + 0j)

        force = NonlinearForce(single_point(place_at(evidence, label, values)), equivalent, harmonics, random)
        return ModelModification(nonlinear=(force,))
