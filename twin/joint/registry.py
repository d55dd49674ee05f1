"""Which laws a rig file may name: the library's, those of installed packages, and those of files that were asked for.

A law is a program.  A rig file names one and never brings one along: code is run only because the user gave its file
(``--laws``, :func:`load_laws`) or has installed its package (entry points of the group ``twin.joint_laws``).
"""

import difflib
import sys
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from recordings.errors import InputError
from twin.joint.library import LIBRARY
from twin.joint.named_law import NamedLaw

GROUP = "twin.joint_laws"

_loaded: dict[Path, tuple[NamedLaw, ...]] = {}


def known_laws() -> dict[str, NamedLaw]:
    """All laws by name; what was asked for comes before what is installed, and that before the library."""
    laws = [*LIBRARY, *_installed(), *(law for file in _loaded.values() for law in file)]
    return {law.name: law for law in laws}


def law_named(name: str) -> NamedLaw:
    """The law of that name.

    Raises
    ------
    ValueError
        If there is none.
    """
    laws = known_laws()
    if name not in laws:
        near = difflib.get_close_matches(name, laws, n=1)
        meant = f"perhaps {near[0]}; " if near else ""
        raise ValueError(f"no law {name!r}: {meant}there are {', '.join(laws)}, and those of a file given by --laws")
    return laws[name]


def load_laws(path: str | Path) -> tuple[NamedLaw, ...]:
    """Run a file of Python and make its laws known, every :class:`twin.joint.NamedLaw` of its top level.

    Raises
    ------
    InputError
        If it cannot be read or run, or has no law.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise InputError(path, "", "no such file")
    module = ModuleType(f"twin_laws_{len(_loaded)}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module  # numba and pickle look there
    try:
        exec(compile(file.read_bytes(), str(file), "exec"), vars(module))
    except Exception as error:
        raise InputError(path, _line_of(error, file), f"{type(error).__name__}: {error}") from error
    laws = tuple(value for value in vars(module).values() if isinstance(value, NamedLaw))
    if not laws:
        raise InputError(path, "", "has no law", "make one: LAW = twin.joint.NamedLaw(...)")
    _loaded[Path(path)] = laws
    return laws


def loaded_files() -> tuple[Path, ...]:
    """The files of :func:`load_laws` as they were named, for processes that are to know the same laws."""
    return tuple(_loaded)


@cache
def _installed() -> tuple[NamedLaw, ...]:
    found = []
    for point in entry_points(group=GROUP):
        law = point.load()
        if not isinstance(law, NamedLaw):
            raise InputError(
                point.value, GROUP, "is not a twin.joint.NamedLaw", "the package that brings it is at fault"
            )
        found.append(law)
    return tuple(found)


def _line_of(error: Exception, file: Path) -> str:
    """The line of the file that an error came by last."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}"
    lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f"line {lines[-1]}" if lines else ""
