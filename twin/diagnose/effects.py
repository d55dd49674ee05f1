"""Effects that a rig file carries, acting in the forward model."""

from __future__ import annotations

from collections.abc import Iterable

from recordings.errors import InputError
from twin.diagnose.causes import CAUSES
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.rigs import Effect

__all__ = ["effects_extension", "unmodelled_effects"]


def effects_extension(evidence: Evidence, effects: Iterable[Effect], *, source: str = "rig") -> Extension:
    """What the effects of a rig file change, all at once.

    Effects without a forward model, see :func:`unmodelled_effects`, change nothing.

    Parameters
    ----------
    source
        The rig file's name, for errors.

    Raises
    ------
    InputError
        If an effect lacks a parameter, has one that its cause does not know, or names what the rig does not have.
    """
    whole = Extension()
    for number, effect in enumerate(effects):
        cause = CAUSES.get(effect.cause)
        if cause is None:
            continue
        label = {name: value for name, value in effect.parameters.items() if isinstance(value, str)}
        values = {name: value for name, value in effect.parameters.items() if not isinstance(value, str)}
        place = f"effect.{number} ({effect.cause})"
        labels = [dict(known) for known in cause.labels(evidence)]
        if label not in labels:
            choices = "; ".join(", ".join(f"{k} = {v}" for k, v in known.items()) or "no names" for known in labels)
            raise InputError(source, place, f"{label or 'no names'} is not one of its choices", f"it takes {choices}")
        likely = {p.name: (*p.starts, p.null)[0] for p in cause.parameters(evidence, label)}
        expected = sorted(cause.reported(likely, {})[0])
        if sorted(values) != expected:
            raise InputError(source, place, f"has the numbers {sorted(values)}", f"it takes {expected}")
        whole = whole.merged(cause.extension(evidence, label, cause.from_reported(values)))
    return whole


def unmodelled_effects(effects: Iterable[Effect]) -> list[str]:
    """Names of effects that only the bench knows: they disturb recordings and do not change a response."""
    return [effect.cause for effect in effects if effect.cause not in CAUSES]
