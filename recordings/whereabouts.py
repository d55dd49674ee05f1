"""Where numbers came to no answer: the run, the channel and the stage, told in one line instead of a stack trace."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from recordings.errors import InputError

TOLD = (InputError, OSError, MemoryError, ImportError)
"""Errors that say already what a person needs."""
REMEDY = "'twin check' may tell what is wrong with it, and --verbose where the error came from"


class Stages:
    """Passes on what is being done, and remembers it."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report, self.now = report, ""

    def __call__(self, text: str) -> None:
        """A stage begins."""
        self.now = text
        self._report(text)


@contextmanager
def working_on(run: str | Path, channel: str = "") -> Iterator[None]:
    """Let an error from within know which run and channel it was about, the innermost if there are several."""
    try:
        yield
    except TOLD:
        raise
    except Exception as error:
        if not hasattr(error, "whereabouts"):
            error.whereabouts = (str(run), channel)  # type: ignore[attr-defined]
        raise


@contextmanager
def told_in_one_line(source: str | Path, stages: Stages) -> Iterator[None]:
    """Turn whatever a numerical library raises into one line.

    Parameters
    ----------
    source
        What is to blame where :func:`working_on` does not know better.
    stages
        Which of them it was.

    Raises
    ------
    InputError
        In place of any error that would end in a stack trace.
    """
    try:
        yield
    except TOLD:
        raise
    except Exception as error:
        run, channel = getattr(error, "whereabouts", (str(source), ""))
        during = f" while {stages.now}" if stages.now else ""
        what = str(error).strip().splitlines()[0] if str(error).strip() else ""
        reason = f"no answer{during} ({type(error).__name__}{': ' + what if what else ''})"
        raise InputError(run, f"channel {channel}" if channel else "", reason, REMEDY) from error
