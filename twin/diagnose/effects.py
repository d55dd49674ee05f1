"""Effects that a rig file carries: what an earlier diagnosis found acts in every later prediction."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

from recordings.errors import InputError, blamed_on
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.models import CAUSES
from twin.diagnose.places import from_told_place, told_place
from twin.identify.measured_data import MeasuredData
from twin.rigs import Effect

Data = TypeVar("Data", bound=MeasuredData)


def acting_effects(
    evidence: MeasuredData, effects: Iterable[Effect], *, source: str = "rig"
) -> tuple[CauseHypothesis, ...]:
    """The effects as the forward model has them.

    Effects without a forward model, see :func:`left_out_effects`, change nothing and are left out.

    InputError if an effect lacks a parameter, has one that its cause does not know, or names what the rig does not
    have.
    """
    acting = []
    for number, effect in enumerate(effects):
        cause = CAUSES.get(effect.cause)
        if cause is None:
            continue
        labels = [dict(known) for known in cause.labels(evidence)]
        names = {name for known in labels for name in known}
        label, values = dict(cause.assumed(evidence)), {}
        for name, value in effect.parameters.items():
            if isinstance(value, str):
                label[name] = value
            elif name in names:
                label[name] = f"{value:g}"  # a number by which something is named
            else:
                values[name] = value
        place = f"effect.{number} ({effect.cause})"
        if label not in labels:
            choices = "; ".join(", ".join(f"{k} = {v}" for k, v in known.items()) or "no names" for known in labels)
            raise InputError(source, place, f"{label or 'no names'} is not one of its choices", f"it takes {choices}")
        likely = {p.name: (*p.starts, p.null)[0] for p in cause.parameters(evidence, label)}
        expected = sorted(told_place(evidence, label, *cause.reported(likely, {}))[0])
        if sorted(values) != expected:
            raise InputError(source, place, f"has the numbers {sorted(values)}", f"it takes {expected}")
        with blamed_on(source, place, "take one of the part's own table"):
            values = from_told_place(evidence, label, cause.from_reported(values))
        acting.append(CauseHypothesis(cause, label, values, dict(effect.std)))
    return tuple(acting)


def with_effects(evidence: Data, *, source: str = "rig") -> Data:
    """The evidence, every prediction of which has the effects of its rig file.

    A fit of the linear parameters that lacked them is left out.

    InputError as :func:`acting_effects`.
    """
    effects = acting_effects(evidence, evidence.rig.effect, source=source)
    if not effects:
        return evidence
    return replace(evidence, effects=effects, linear=None)


def left_out_effects(effects: Iterable[Effect]) -> list[str]:
    """A sentence on each effect that only the bench knows: it disturbs recordings and does not change a response."""
    left_out = [effect.cause for effect in effects if effect.cause not in CAUSES]
    return [f"the effect {cause} acts on recordings only and is left out" for cause in left_out]
