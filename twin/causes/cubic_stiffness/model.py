"""A stiffening spring to ground: a taut wire, a membrane, a geometric effect of the suspension."""

from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values
from twin.diagnose.places import place_at, place_labels, position, single_point
from twin.identify.model_modification import ModelModification, NoiseMotion, NonlinearForce


class CubicStiffness(Cause):
    """f = k v^3: three quarters of k a^2 as equivalent stiffness, a quarter of k a^3 in the third harmonic."""

    name = "cubic-stiffness"
    summary = "a spring to ground stiffens with the cube of its displacement"
    labels = staticmethod(place_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Stiffness and place; the prior's scale is a force of 0.2 N at the largest measured tip amplitude.

        In one mode a stiffness here does what (phi / phi')^4 of it does there: what tells them apart is hardly larger
        than the model's own error of the channels' ratio, and both are found roughly.
        """
        largest = max(float(np.max(evidence.steps.amplitude_m, initial=0.0)), 1e-5)
        unit = 0.2 / largest**3
        return (
            Parameter(
                name="stiffness_N_per_m3", scale=10 * unit, lower=-200 * unit, upper=2e4 * unit, null=0.0,
                tolerance=1e-4, starts=(unit,),
            ),
            *position(evidence, label, 8),
        )  # fmt: skip

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A local nonlinear force."""
        k = values["stiffness_N_per_m3"]

        def harmonics(a: Any, count: int, omega: Any) -> Any:
            out = np.zeros((len(a), count), complex)
            out[:, 0] = 0.75 * k * a**3
            if count >= 3:
                out[:, 2] = 0.25 * k * a**3
            return out

        def random(motion: NoiseMotion, omega: Any) -> Any:
            return np.full(len(omega), 3 * k * motion.displacement**2 + 0j)

        place = single_point(place_at(evidence, label, values))
        force = NonlinearForce(place, lambda a, omega: 0.75 * k * a**2 + 0j, harmonics, random)
        return ModelModification(nonlinear=(force,))
