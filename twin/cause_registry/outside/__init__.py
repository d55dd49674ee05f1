"""Causes from outside the package: files that the user names, and entry points ``twin.causes`` of other distributions.

The files named stand in the environment variable ``TWIN_CAUSES``, so that the worker processes of a diagnosis or of a
campaign know them too; each is imported as a module of this package, by its own name.
"""

import os
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module, invalidate_caches
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from recordings.errors import InputError
from twin.cause_registry.draws import LISTED

VARIABLE = "TWIN_CAUSES"
GROUP = "twin.causes"


@dataclass(frozen=True, kw_only=True)
class OutsideCause:
    """A cause that is no part of the package."""

    name: str
    """As in recordings, rig files and answers."""
    effect: Callable[..., None] | None = None
    """What it does to the bench: a function of :class:`twin.bench.plan.Plan` and of its parameters by name."""
    model: Any = None
    """How a diagnosis predicts it: a :class:`twin.diagnose.cause.Cause` of the same name and parameters."""
    finding: Callable[..., list[Any]] | None = None
    """For a fault that the samples show by themselves: a function of runs that returns a list of
    :class:`twin.diagnose.signals.finding.Finding`."""
    draw: Callable[..., dict[str, float | str]] | None = None
    """Parameters of normal size for campaigns, from :class:`twin.cause_registry.dice.Dice`."""


def _files() -> tuple[Path, ...]:
    return tuple(Path(path) for path in os.environ.get(VARIABLE, "").split(os.pathsep) if path)


def _search_there() -> None:
    """Let a module of this package be any of the files."""
    for path in _files():
        folder = str(path.parent)
        if folder not in __path__:
            __path__.append(folder)


_search_there()
_loaded: dict[str, tuple[OutsideCause, ...]] = {}


def outside_causes() -> tuple[OutsideCause, ...]:
    """All of them, those of files first; InputError if one cannot be imported, or is no cause."""
    _search_there()
    key = os.environ.get(VARIABLE, "")
    if key not in _loaded:
        found = [cause for path in _files() for cause in _of_file(path)]
        for entry in entry_points(group=GROUP):
            found += _causes_of(_imported(entry.value, entry.load), f"entry point {entry.name}")
        _loaded[key] = tuple(found)
    return _loaded[key]


def load_causes(path: Path) -> tuple[OutsideCause, ...]:
    """Add the causes of a file for this process and those that it starts.

    Raises
    ------
    InputError
        If there is no such file, it cannot be imported, has no cause, or one whose name is taken.
    """
    path = path.resolve()
    if not path.is_file():
        raise InputError(path, "", "there is no such file", "name a Python file with a CAUSE in it")
    if not path.stem.isidentifier() or path.suffix != ".py":
        raise InputError(path, "", "is not a valid module name", "use letters, digits and _, then .py")
    known = _files()
    if path in known:
        return _of_file(path)
    if any(path.stem == other.stem for other in known):
        raise InputError(path, "", f"another file of causes is called {path.stem} too", "rename one of them")
    before = os.environ.get(VARIABLE, "")
    taken = {*LISTED, *(cause.name for cause in outside_causes())}
    os.environ[VARIABLE] = os.pathsep.join([*map(str, known), str(path)])
    try:
        _search_there()
        found = _of_file(path)
        for cause in found:
            if cause.name in taken:
                raise InputError(path, "CAUSE", f"the name {cause.name} is taken", "give it a name of its own")
    except InputError:
        os.environ[VARIABLE] = before
        raise
    return found


def _of_file(path: Path) -> tuple[OutsideCause, ...]:
    invalidate_caches()
    module = _imported(str(path), lambda: import_module(f"{__name__}.{path.stem}"))
    where = getattr(module, "__file__", None)
    if where is None or Path(where).resolve() != path:
        raise InputError(path, "", f"is not what was imported as {path.stem}, which is {where}", "rename the file")
    return _causes_of(getattr(module, "CAUSE", None), str(path))


def _imported(source: str, load: Callable[[], Any]) -> Any:
    """Import a stranger's code, whatever it raises."""
    try:
        return load()
    except InputError:
        raise
    except Exception as error:
        last = traceback.extract_tb(sys.exc_info()[2])[-1]
        line = error.lineno if isinstance(error, SyntaxError) else last.lineno
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        raise InputError(source, f"line {line}", f"cannot be imported ({reason:.120})", "mend it") from error


def _causes_of(found: Any, source: str) -> tuple[OutsideCause, ...]:
    causes = tuple(found) if isinstance(found, list | tuple) else (found,)
    for cause in causes:
        if not isinstance(cause, OutsideCause):
            reason = "has no CAUSE" if cause is None else f"its CAUSE is a {type(cause).__name__}"
            raise InputError(source, "CAUSE", reason, "set it to a twin.causes.OutsideCause, or to a list of them")
        if cause.model is not None and getattr(cause.model, "name", None) != cause.name:
            told = getattr(cause.model, "name", None)
            raise InputError(source, cause.name, f"its model is called {told!r}", "give both the same name")
    return causes
