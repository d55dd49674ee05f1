"""Something loose that resonates by itself: a cable, a bracket, a dangling connector."""

from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values
from twin.diagnose.places import place_at, place_labels, point, position
from twin.identify.model_modification import Attachment, ModelModification

BEGUN = 0.03
"""Damping ratio that fits begin with."""


class AttachedResonator(Cause):
    """A mass on a damped spring."""

    name = "attached-resonator"
    summary = "a small mass on a spring of its own hangs on the structure"
    labels = staticmethod(place_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Mass, frequency, damping and place."""
        high = max([float(data.frequency_Hz[-1]) for data in evidence.broadband], default=200.0)
        low = min([float(data.frequency_Hz[0]) for data in evidence.broadband], default=5.0)
        seen = [f for data in evidence.broadband for f in data.resonances_Hz if low < f < high]
        # The likeliest places first: a light one far from the structure's own resonances shows there alone.
        frequencies = tuple(float(f) for f in (*np.geomspace(max(low, 12.0), high, 14), *seen))
        # Above all that was measured a resonator is but a mass, below it a spring with a dashpot: causes of their own.
        # So is one so damped that it hardly resonates: what then follows the data is the freedom of four parameters.
        return (
            # Tuned to a resonance it counts 1 / (2 zeta) times what a plain mass does, and is tolerated as much less.
            Parameter(
                name="mass_kg", scale=0.02, lower=0.0, upper=0.3, null=0.0, starts=(0.003,), tolerance=2e-3 * BEGUN
            ),
            Parameter(name="frequency_Hz", scale=high, lower=low, upper=high, starts=frequencies),
            Parameter(name="damping_ratio", scale=0.1, lower=1e-3, upper=0.25, starts=(BEGUN,)),
            *position(evidence, label, 8),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Dynamic stiffness of a seismic mass."""
        m, w, z = values["mass_kg"], 2 * np.pi * values["frequency_Hz"], values["damping_ratio"]

        def stiffness(omega: Any) -> Any:
            r = omega / w
            link = 1 + 2j * z * r
            return (-m * omega**2 * link / (link - r**2))[:, None]

        return ModelModification(attachments=(Attachment(point(place_at(evidence, label, values)), stiffness),))
