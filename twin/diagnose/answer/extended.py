"""The extended model as a rig file that every other command accepts."""

from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.places import told_place
from twin.diagnose.selection.search import Search
from twin.identify.measured_data import MeasuredData
from twin.identify.updated_rig import updated_rig
from twin.rigs import Effect, Rig


def updated_rig_file(evidence: MeasuredData, search: Search) -> Rig:
    """The nominal rig with what was identified and, as effects, what was named."""
    rig = updated_rig(evidence, search.model.baseline, search.model.solution)
    return rig.model_copy(update={"effect": [*rig.effect, *effects_of(evidence, search.model)]})


def effects_of(evidence: MeasuredData, model: FittedModel) -> list[Effect]:
    """A model's causes as a rig file has them."""
    effects = []
    for hypothesis in model.hypotheses:
        values, errors, _ = told_place(
            evidence, hypothesis.label, *hypothesis.cause.reported(hypothesis.values, hypothesis.std)
        )
        effects.append(Effect(cause=hypothesis.cause.name, parameters={**hypothesis.label, **values}, std=errors))
    return effects
