"""A part of one channel leaks into another."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values


class CrossTalk(Cause):
    """Adds a part of a source channel's reading, in its own unit, to a response channel's."""

    name = "cross-talk"
    summary = "a part of one channel leaks into another"
    numbers = (Parameter(name="factor", scale=0.1, lower=-10.0, upper=10.0, null=0.0, starts=(0.003,)),)

    def labels(self, evidence: MeasuredData) -> Labels:
        """Any response channel from any other channel."""
        sources = (*evidence.channels, evidence.force)
        return tuple({"channel": c, "source": s} for c in evidence.channels for s in sources if s != c)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The leak."""
        return ModelModification(cross_talk=((label["channel"], label["source"], values["factor"]),))
