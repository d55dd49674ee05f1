"""Hidden causes on the bench: what each does to a rig, its joint or its measuring chain.

Names and parameters are the recording contract's.  This is the truth's side: nothing of the diagnosis is used here.
"""

import inspect
from collections.abc import Callable, Iterable, MutableMapping
from typing import Any

from twin.bench.plan import Plan
from twin.cause_registry import Registered, from_folders
from twin.rigs import Effect

EFFECTS: MutableMapping[str, Callable[..., None]] = Registered(
    "effect", from_folders("effect", lambda module, name: getattr(module, name.replace("-", "_")))
)
"""Every cause by its contract name, the function named as its folder; each takes the plan, and its parameters by name.
"""
PLACE = {name: p for name, p in inspect.signature(Plan.place).parameters.items() if name != "self"}
"""What tells in a rig file where an effect acts that takes a `place`."""


def apply_effects(plan: Plan, effects: Iterable[Effect]) -> None:
    """Let each effect alter the plan, in order.

    ValueError if there is no such cause, it has other parameters, or the rig has nothing that they name; here, or when
    the plan is built.
    """
    for number, effect in enumerate(effects):
        changed: tuple[list[Callable[..., Any]], ...] = (plan.matrix_changes, plan.element_makers)
        before = [len(changes) for changes in changed]
        where = f"effect.{number}, {effect.cause}"
        _named(_checked(effect), where)(plan, **effect.parameters)
        for changes, first in zip(changed, before, strict=True):
            changes[first:] = [_named(change, where) for change in changes[first:]]


def _named(function: Callable[..., Any], where: str) -> Callable[..., Any]:
    """The function with the place of the effect before what it refuses."""

    def named(*given: Any, **parameters: Any) -> Any:
        try:
            return function(*given, **parameters)
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from error

    return named


def _checked(effect: Effect) -> Callable[..., None]:
    """What a cause does, given only parameters that it has and of the kinds that its annotations tell."""

    def apply(plan: Plan, **parameters: Any) -> None:
        function = EFFECTS.get(effect.cause)
        if function is None:
            raise ValueError(f"there is no such effect; there are {', '.join(EFFECTS)}")
        takes = {name: p for name, p in inspect.signature(function).parameters.items() if name != "plan"}
        placed = takes.pop("place", None) is not None
        takes |= PLACE if placed else {}
        needed = {name for name, p in takes.items() if p.default is p.empty}
        if not needed <= set(parameters) <= set(takes):
            raise ValueError(f"it takes {', '.join(sorted(takes))}; got {', '.join(sorted(parameters))}")
        for name, value in parameters.items():
            annotation = takes[name].annotation
            kind = getattr(annotation, "__name__", str(annotation))  # a class, or text where they are put off
            if kind.startswith("float") and not isinstance(value, float):
                raise ValueError(f"{name} is a number, not {value!r:.60}")
            if kind.startswith("str") and isinstance(value, float):
                parameters[name] = f"{value:g}"  # elements are counted, and may be written as numbers
        if placed:
            told = {name: parameters.pop(name) for name in PLACE if name in parameters}
            parameters["place"] = plan.place(**told)
        function(plan, **parameters)

    return apply
