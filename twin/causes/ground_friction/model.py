"""Dry friction against the surroundings: a cable that drags, a probe that touches."""

from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values
from twin.diagnose.places import place_at, place_labels, position, single_point
from twin.diagnose.slider_in_noise import slider_in_noise
from twin.identify.jenkins import jenkins_harmonics
from twin.identify.model_modification import ModelModification, NoiseMotion, NonlinearForce

TRAVEL_m = 2e-6
"""What contacts of metal give before they slip."""


class GroundFriction(Cause):
    """Coulomb friction behind the little that every contact gives: a Jenkins element to ground.

    Stepped sines slip all the time and show the friction force; noise of small amplitude may hardly slip at all, and
    sees a spring instead.  The travel at which it slips is fitted beside the contract's parameters, and not reported.
    """

    name = "ground-friction"
    summary = "something drags on the structure with dry friction"
    labels = staticmethod(place_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Friction force, place, and travel before it slips."""
        return (
            Parameter(name="force_N", scale=0.1, lower=0.0, upper=5.0, null=0.0, starts=(0.02,)),
            *position(evidence, label, 8),
            # Never reported: its error is what a slider's linear substitute in noise may leave behind.
            Parameter(name="travel_m", scale=3e-6, lower=1e-8, upper=3e-5, starts=(TRAVEL_m, 0.1 * TRAVEL_m)),
        )

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Force and place."""
        told, errors = ({name: each[name] for name in each if name != "travel_m"} for each in (values, std))
        return told, errors

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return force and place, with a usual travel."""
        return {**values, "travel_m": TRAVEL_m}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A local force."""
        F, k = values["force_N"], values["force_N"] / values["travel_m"]

        def harmonics(a: Any, count: int, omega: Any) -> Any:
            return jenkins_harmonics(a, k, F, count)

        def equivalent(a: Any, omega: Any) -> Any:
            return jenkins_harmonics(a, k, F, 1)[:, 0] / np.maximum(a, 1e-15)

        def random(motion: NoiseMotion, omega: Any) -> Any:
            return slider_in_noise(motion, omega, k, F)

        force = NonlinearForce(single_point(place_at(evidence, label, values)), equivalent, harmonics, random)
        return ModelModification(nonlinear=(force,))
