"""Where everything that belongs to a cause is found: its effect on the bench, its model, its finding, its draw.

Each cause is a folder here.  ``effect.py`` is the truth's side, ``model.py`` the diagnosis'; neither imports the other,
and nothing is imported before it is asked for, so that the bench never meets an inference.  Causes from outside come
from files, see :mod:`twin.causes.outside`, and from the entry points of other distributions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Generic, TypeVar

__all__ = ["DRAWS", "FINDINGS", "NAMES", "Registered"]

T = TypeVar("T")

NAMES = (
    "added-mass",
    "beam-modulus",
    "clamp-compliance",
    "transverse-shear",
    "stiffness-loss",
    "attached-resonator",
    "cubic-stiffness",
    "ground-friction",
    "ground-stop",
    "viscous-damper",
    "air-drag",
    "joint-stiffness",
    "joint-slap",
    "joint-friction",
    "joint-uneven",
    "preload-loss",
    "drive-mass",
    "stinger-stiffness",
    "drive-position",
    "sensor-position",
    "base-motion",
    "temperature-drift",
    "channel-gain",
    "channel-delay",
    "channel-polarity",
    "clipping",
    "ac-coupling",
    "mounting-resonance",
    "cross-talk",
    "mains-hum",
    "sample-clock",
    "unsettled-dwell",
    "lost-samples",
    "quantisation",
)
"""The causes of the recording contract, in the order of lists and reports; the folders are named alike."""


class Registered(MutableMapping[str, T], Generic[T]):
    """One part of every cause that has it, by the cause's name; imported when it is first asked for.

    Parameters
    ----------
    part
        ``effect``, ``model``, ``finding`` or ``draw``: a module of the cause's folder, and an attribute of a cause from
        outside.
    get
        What to take from that module.
    """

    def __init__(self, part: str, get: Callable[[Any, str], T]) -> None:
        self._part, self._get = part, get
        self._found: dict[str, T] = {}
        self._complete = False

    def _all(self) -> dict[str, T]:
        from twin.causes.outside import outside_causes

        if not self._complete:
            known, self._found = self._found, {}
            for name in NAMES:
                module = f"twin.causes.{name.replace('-', '_')}.{self._part}"
                if find_spec(module) is not None:
                    self._found[name] = self._get(import_module(module), name)
            self._found |= known
            self._complete = True
        parts = ((cause.name, getattr(cause, self._part)) for cause in outside_causes())
        return self._found | {name: part for name, part in parts if part is not None}

    def __getitem__(self, name: str) -> T:
        return self._all()[name]

    def __setitem__(self, name: str, part: T) -> None:
        self._all()
        self._found[name] = part

    def __delitem__(self, name: str) -> None:
        del self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())


def _draw(module: Any, name: str) -> Any:
    return module.draw


DRAWS: Mapping[str, Callable[..., dict[str, float | str]]] = Registered("draw", _draw)
"""By name, a function of :class:`twin.causes.dice.Dice` that gives parameters of normal size."""


def _finding(module: Any, name: str) -> Any:
    return next(getattr(module, function) for function in module.__all__ if function.startswith("find_"))


FINDINGS: Mapping[str, Callable[..., Any]] = Registered("finding", _finding)
"""By name, what looks for a fault in the samples of runs and returns a list of its findings."""
