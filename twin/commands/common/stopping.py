"""How long work is asked to end: in order, with what it has."""

import ctypes
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

ASKED = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def terminable() -> Iterator[None]:
    """SIGTERM ends the block as Ctrl-C does, by a KeyboardInterrupt."""
    usual = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, usual)


def end_with_parent(parent: int) -> None:
    """Be sent SIGTERM when process `parent`, which has started this one, ends, however it does."""
    ctypes.CDLL(None).prctl(1, int(signal.SIGTERM))  # PR_SET_PDEATHSIG
    if os.getppid() != parent:  # it was quicker
        os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def deaf() -> Iterator[None]:
    """Processes that are started within the block hear neither: they are told to end in another way."""
    usual = {number: signal.signal(number, signal.SIG_IGN) for number in ASKED}
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
