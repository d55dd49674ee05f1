"""A part of one channel leaks into another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["CrossTalk"]


class CrossTalk(Cause):
    """Adds a part of a source channel's reading, in its own unit, to a response channel's."""

    name = "cross-talk"
    summary = "a part of one channel leaks into another"

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Any response channel from any other channel."""
        sources = (*evidence.channels, evidence.force)
        return tuple({"channel": c, "source": s} for c in evidence.channels for s in sources if s != c)

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """The part that leaks, in units of channel per source."""
        return (
            Parameter(name="factor", scale=0.1, lower=-10.0, upper=10.0, null=0.0, starts=(0.003,), model_error=0.015),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """The leak."""
        return Extension(cross_talk=((label["channel"], label["source"], values["factor"]),))
