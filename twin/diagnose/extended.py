"""The extended model as a rig file that every other command accepts."""

from __future__ import annotations

from twin.diagnose.places import told_place
from twin.diagnose.search import Search
from twin.identify.evidence import Evidence
from twin.identify.updated_rig import updated_rig
from twin.rigs import Effect, Rig

__all__ = ["extended_rig"]


def extended_rig(evidence: Evidence, search: Search) -> Rig:
    """The believed rig with what was identified and, as effects, what was blamed."""
    rig = updated_rig(evidence, search.model.unknowns, search.model.solution)
    effects = []
    for blame in search.model.blames:
        values, errors, _ = told_place(evidence, blame.label, *blame.cause.reported(blame.values, blame.std))
        effects.append(Effect(cause=blame.cause.name, parameters={**blame.label, **values}, std=errors))
    return rig.model_copy(update={"effect": [*rig.effect, *effects]})
