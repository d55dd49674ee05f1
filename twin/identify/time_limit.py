"""How long a search may take: known to every fit below it."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_end: ContextVar[float] = ContextVar("_end", default=float("inf"))


@contextmanager
def time_limit(end_s: float) -> Iterator[None]:
    """Within this context, let fits end where they are once :func:`time.monotonic` has come to `end_s`."""
    token = _end.set(min(end_s, _end.get()))
    try:
        yield
    finally:
        _end.reset(token)


def end_of_time() -> float:
    """When that is, on the clock of :func:`time.monotonic`, which all processes share; infinity if never."""
    return _end.get()


def time_is_up() -> bool:
    """Whether it has been."""
    return time.monotonic() >= _end.get()
