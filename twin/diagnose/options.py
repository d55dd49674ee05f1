"""How a diagnosis goes about its search."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from recordings.errors import InputError
from twin.diagnose.cause import Cause
from twin.diagnose.models import CAUSES
from twin.diagnose.parallel_map import in_processes
from twin.identify.time_limit import time_limit


@dataclass(frozen=True, kw_only=True)
class DiagnosisOptions:
    """What a diagnosis looks for, and how far it goes.

    Raises
    ------
    InputError
        If a cause to exclude is none of those that are fitted.
    """

    causes: Mapping[str, Cause] = field(default_factory=lambda: CAUSES)
    """What may be named, apart from what the samples themselves show."""
    thorough: bool = False
    """Whether more rivals are fitted to recordings, from more beginnings and for longer."""
    exclude: Sequence[str] = ()
    """Causes that the next procedure is to show or to exclude, at the largest size at which they could hide now."""
    time_limit_s: float = float("inf")
    """After which fits end where they are, and the answer says so."""
    processes: int = 1
    """How many fit causes side by side.  With more than one a script must guard its main part by
    ``if __name__ == "__main__"``."""

    def __post_init__(self) -> None:
        if unknown := sorted(set(self.exclude) - set(self.causes)):
            remedy = f"name one of {', '.join(self.causes)}"
            raise InputError("--exclude", unknown[0], "is no cause that is fitted", remedy)

    @contextmanager
    def in_effect(self) -> Iterator[None]:
        """Within this context fits have the processes, and from now on the time, that the options give them."""
        with in_processes(self.processes), time_limit(time.monotonic() + self.time_limit_s):
            yield
