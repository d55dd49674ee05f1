"""Air that resists with the square of the velocity, all along the beams."""

from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, Parameter, Values
from twin.diagnose.places import single_point
from twin.identify.model_modification import ModelModification, NoiseMotion, NonlinearForce

POINTS = 10


class AirDrag(Cause):
    """A force c v|v| per length; |sin| sin has the fundamental 8 / (3 pi) and the third harmonic -8 / (15 pi)."""

    name = "air-drag"
    summary = "the air's resistance grows with the square of the velocity"
    numbers = (Parameter(name="coefficient_Ns2_per_m3", scale=0.3, lower=0.0, upper=50.0, null=0.0, starts=(0.05,)),)

    def labels(self, evidence: MeasuredData) -> Labels:
        """One search where there are beams."""
        return ({},) if evidence.rig.layout().beams else ()

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Local forces at the midpoints of equal lengths."""
        layout = evidence.rig.layout()
        length = layout.length / POINTS
        c = values["coefficient_Ns2_per_m3"] * length

        def equivalent(a: Any, omega: Any) -> Any:
            return 1j * 8 / (3 * np.pi) * c * omega**2 * a

        def harmonics(a: Any, count: int, omega: Any) -> Any:
            out = np.zeros((len(a), count), complex)
            for h in range(1, count + 1, 2):
                out[:, h - 1] = -1j * 8 / (np.pi * h * (h**2 - 4)) * c * (omega * a) ** 2
            return out

        def random(motion: NoiseMotion, omega: Any) -> Any:
            return 1j * omega * np.sqrt(8 / np.pi) * c * motion.velocity

        places = [single_point(layout.place((i + 0.5) * length)) for i in range(POINTS)]
        return ModelModification(
            nonlinear=tuple(NonlinearForce(place, equivalent, harmonics, random) for place in places)
        )
