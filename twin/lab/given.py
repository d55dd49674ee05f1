"""What a command or a call was given: recordings, frequency responses or tables, and the preload asked for."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from recordings import InputError, Run
from recordings.responses import are_responses
from twin.lab.recording import Recording
from twin.rigs import Rig
from twin.rigs.preloads import known_preload

AnyRun = Recording | Run | str | Path
Runs = AnyRun | Iterable[AnyRun]
Report = Callable[[str], None]
"""Told what is being done."""


def no_scatter() -> InputError:
    """What is told where a scatter stands beside what is no frequency response."""
    return InputError("--frequency-scatter", "", "belongs to frequency responses alone", "leave it out")


def one_preload(preloads: Sequence[str], rig: Rig) -> str | None:
    """The preload that was asked for, if one was; InputError if several were, or the rig has it not."""
    if len(preloads) > 1:
        raise InputError(
            "--preload", "", "is given more than once", "diagnose the recordings of each preload by themselves"
        )
    return known_preload(rig, preloads[0]) if preloads else None


def are_all_responses(paths: Sequence[Path]) -> bool:
    """Whether these files hold frequency responses; InputError if only some do."""
    kinds = [path.is_file() and are_responses(path) for path in paths]
    if any(kinds) and not all(kinds):
        odd = paths[kinds.index(False)]
        raise InputError(odd, "", "stands beside frequency responses", "give one kind of evidence at a time")
    return any(kinds)


def listed(runs: Runs) -> list[AnyRun]:
    """One run or several, as a list."""
    return [runs] if isinstance(runs, Recording | Run | str | Path) else list(runs)


def are_tables(paths: Sequence[Path]) -> bool:
    """Whether all of these files are tables.

    Raises
    ------
    InputError
        If one is not there, or is a folder; if tables and recordings are mixed.
    """
    for path in paths:
        if path.is_dir():
            raise InputError(path, "", "is a folder", "give the recordings (.mcap) or tables (.csv) in it")
        if not path.exists():
            raise InputError(path, "", "there is no such file")
    tables = [path.suffix.lower() == ".csv" for path in paths]
    if any(tables) and not all(tables):
        odd = paths[tables.index(not tables[0])]
        raise InputError(
            odd, "", f"stands beside {paths[0]}: tables and recordings cannot be diagnosed together", "give either"
        )
    return bool(tables) and all(tables)
