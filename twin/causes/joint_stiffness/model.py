"""The joint's linear stiffness is far from what was assumed: another torque, another surface."""

import math
from dataclasses import replace

from twin.causes.joints import JointCause
from twin.diagnose.cause import Label, MeasuredData, ModelModification, Parameter, Values
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_fit import MODULI_STD
from twin.rigs import moduli_at

SCALE = 0.7
"""Half or twice what was assumed is usual."""


class JointStiffness(JointCause):
    """Factors on E' and G' beyond the ten per cent that no experimenter knows.

    Fitted by their logarithms, as the moduli themselves are: the data hold the products, and along a straight line in
    logarithms a fit can move from one to the other.
    """

    name = "joint-stiffness"
    summary = "the joint's E' and G' are not those that were assumed"
    numbers = (
        Parameter(name="log_normal_factor", scale=SCALE, lower=-4.0, upper=3.0, null=0.0, starts=(-0.2,)),
        Parameter(name="log_shear_factor", scale=SCALE, lower=-4.0, upper=3.0, null=0.0, starts=(-0.2,)),
    )

    def shared(
        self, evidence: MeasuredData, label: Label, baseline: BaselineParameters, values: Values
    ) -> tuple[BaselineParameters, dict[str, float]]:
        """The data know the products alone: nearly all that the moduli are off by goes into the factors."""
        base, joint = baseline.base, self.number(evidence, label)
        nominal = moduli_at(evidence.rig, evidence.preload)[joint]
        share = SCALE**2 / (SCALE**2 + MODULI_STD**2)
        normal = values["log_normal_factor"] + math.log(base.E[joint] / nominal.normal_modulus)
        shear = values["log_shear_factor"] + math.log(base.G[joint] / nominal.shear_modulus)
        E, G = base.E.copy(), base.G.copy()
        E[joint] = nominal.normal_modulus * math.exp((1 - share) * normal)
        G[joint] = nominal.shear_modulus * math.exp((1 - share) * shear)
        baseline = replace(baseline, base=replace(base, E=E, G=G))
        return baseline, {"log_normal_factor": share * normal, "log_shear_factor": share * shear}

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Return the factors themselves."""
        factors = {name.removeprefix("log_"): math.exp(value) for name, value in values.items()}
        errors = {name.removeprefix("log_"): math.exp(values[name]) * error for name, error in std.items()}
        return factors, errors

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the logarithms of the factors."""
        return {f"log_{name}": math.log(value) for name, value in values.items()}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """Scaled moduli."""
        factors = math.exp(values["log_normal_factor"]), math.exp(values["log_shear_factor"])
        return ModelModification(moduli_factor={self.joint(evidence, label): factors})
