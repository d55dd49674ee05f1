"""The foundation moves with the drive force."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values


class BaseMotion(Cause):
    """What holds the structure moves by a receptance times the drive force, and carries it along."""

    name = "base-motion"
    summary = "the base is not at rest: it moves with the drive force"
    numbers = (Parameter(name="receptance_m_per_N", scale=3e-7, lower=-1e-4, upper=1e-4, null=0.0, starts=(1e-8,)),)

    def labels(self, evidence: MeasuredData) -> Labels:
        """One base, where the structure is held at all."""
        return ({},) if evidence.rig.layout().supports else ()

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A moving base."""
        return ModelModification(base_receptance=values["receptance_m_per_N"])
