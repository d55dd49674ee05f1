"""Where everything that belongs to a cause is found: its effect on the bench, its model, its finding, its draw.

Each cause is a folder of :mod:`twin.causes` and an entry in :mod:`twin.cause_registry.draws`.  ``effect.py`` is the
truth's side, ``model.py`` the diagnosis'; neither imports the other, and nothing is imported before it is asked for, so
that the bench never meets an inference.  Causes from outside come from files, see :mod:`twin.cause_registry.outside`,
and from the entry points of other distributions.
"""

from collections.abc import Callable, Iterator, Mapping, MutableMapping
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Generic, TypeVar

from twin.cause_registry.draws import LISTED
from twin.cause_registry.outside import outside_causes

T = TypeVar("T")

NAMES = tuple(LISTED)
"""The causes of the recording contract, in the order of lists and reports."""


class Registered(MutableMapping[str, T], Generic[T]):
    """One part of every cause that has it, by the cause's name; imported when it is first asked for.

    Parameters
    ----------
    part
        ``effect``, ``model``, ``finding`` or ``draw``: the attribute of a cause from outside.
    """

    def __init__(self, part: str, listed: Callable[[], Mapping[str, T]]) -> None:
        self._part, self._listed = part, listed

    @cached_property
    def _own(self) -> dict[str, T]:
        return dict(self._listed())

    def _all(self) -> dict[str, T]:
        parts = ((cause.name, getattr(cause, self._part)) for cause in outside_causes())
        return self._own | {name: part for name, part in parts if part is not None}

    def __getitem__(self, name: str) -> T:
        return self._all()[name]

    def __setitem__(self, name: str, part: T) -> None:
        self._own[name] = part

    def __delitem__(self, name: str) -> None:
        del self._own[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())


def from_folders(part: str, get: Callable[[Any, str], T]) -> Callable[[], dict[str, T]]:
    """The parts in modules of that name, one in the folder of each cause that has it.

    Parameters
    ----------
    get
        What to take from a module and the cause's name.
    """

    def listed() -> dict[str, T]:
        modules = {name: f"twin.causes.{name.replace('-', '_')}.{part}" for name in NAMES}
        return {name: get(import_module(path), name) for name, path in modules.items() if find_spec(path) is not None}

    return listed


DRAWS: Mapping[str, Callable[..., dict[str, float | str]]] = Registered("draw", lambda: LISTED)
"""By name, a function of :class:`twin.cause_registry.dice.Dice` that gives parameters of normal size."""


def _finding(module: Any, name: str) -> Any:
    """The function named as the folder."""
    return getattr(module, f"find_{name.replace('-', '_')}")


FINDINGS: Mapping[str, Callable[..., Any]] = Registered("finding", from_folders("finding", _finding))
"""By name, what looks for a fault in the samples of runs and returns a list of its findings."""
