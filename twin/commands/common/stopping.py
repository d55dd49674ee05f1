"""How long work is asked to end: in order, with what it has."""

import ctypes
import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import Any

ASKED = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def handling(handlers: Mapping[signal.Signals, Any]) -> Iterator[None]:
    """Within the block these signals are handled so, and behind it as before."""
    usual = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)


def terminable() -> AbstractContextManager[None]:
    """SIGTERM ends the block as Ctrl-C does, by a KeyboardInterrupt."""
    return handling({signal.SIGTERM: signal.default_int_handler})


def end_with_parent(parent: int) -> None:
    """Be sent SIGTERM when process `parent`, which has started this one, ends, however it does."""
    ctypes.CDLL(None).prctl(1, int(signal.SIGTERM))  # PR_SET_PDEATHSIG
    if os.getppid() != parent:  # it was quicker
        os.kill(os.getpid(), signal.SIGTERM)


def deaf() -> AbstractContextManager[None]:
    """Processes that are started within the block hear neither: they are told to end in another way."""
    return handling(dict.fromkeys(ASKED, signal.SIG_IGN))
