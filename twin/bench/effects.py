"""Hidden causes on the bench: what each does to a rig, its joint or its measuring chain.

Names and parameters are the recording contract's.  This is the truth's side: nothing of the diagnosis is used here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, MutableMapping
from typing import Any

from twin.bench.plan import Plan
from twin.causes import Registered, from_folders
from twin.rigs import Effect

__all__ = ["EFFECTS", "apply_effects"]


def _effect(module: Any, name: str) -> Callable[..., None]:
    """The function named as the folder."""
    function: Callable[..., None] = getattr(module, name.replace("-", "_"))
    return function


EFFECTS: MutableMapping[str, Callable[..., None]] = Registered("effect", from_folders("effect", _effect))
"""Every cause by its contract name; each takes the plan, and its parameters by name."""


def apply_effects(plan: Plan, effects: Iterable[Effect]) -> None:
    """Let each effect alter the plan, in order.

    Raises
    ------
    ValueError
        If there is no such cause, or it has other parameters.
    """
    for effect in effects:
        function = EFFECTS.get(effect.cause)
        if function is None:
            raise ValueError(f"unknown effect {effect.cause!r}; there are {', '.join(EFFECTS)}")
        takes = {name: p for name, p in inspect.signature(function).parameters.items() if name != "plan"}
        known, needed = set(takes), {name for name, p in takes.items() if p.default is p.empty}
        if not needed <= set(effect.parameters) <= known:
            raise ValueError(
                f"effect {effect.cause!r} takes {', '.join(sorted(known))}; got {', '.join(sorted(effect.parameters))}"
            )
        function(plan, **effect.parameters)
