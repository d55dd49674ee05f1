"""Ctrl-C and SIGTERM wait until a record is whole: half of one would spoil the file for those that follow."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any


class _Uninterrupted:
    """A context, entered again and again, at whose end signals come that arrived within it.

    Signals reach Python code in the main thread alone; for a writer made in another one there is nothing to do.
    Between :meth:`install` and :meth:`remove` it stands before the handlers that were there, as setting and resetting
    them around every record would cost more than writing it.
    """

    def __init__(self) -> None:
        self._users: set[int] = set()
        self._busy = False
        self._late: list[int] = []
        self._before: dict[int, Any] = {}

    def install(self, user: object) -> None:
        """Stand before the handlers of SIGINT and SIGTERM until the last user has removed it."""
        if threading.current_thread() is not threading.main_thread():
            return
        self._users.add(id(user))
        for number in (signal.SIGINT, signal.SIGTERM):
            handler = signal.getsignal(number)
            if handler not in (None, self._handle):  # one that was not set from Python could not be set again
                self._before[number] = handler
                signal.signal(number, self._handle)

    def remove(self, user: object) -> None:
        """Put the handlers back, where nobody has set others meanwhile; doing it twice does no harm."""
        self._users.discard(id(user))
        if self._users or threading.current_thread() is not threading.main_thread():
            return
        for number, handler in self._before.items():
            if signal.getsignal(number) == self._handle:
                signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self._busy:
            self._late.append(number)
            return
        handler = self._before[number]
        if callable(handler):
            handler(number, frame)
        elif handler == signal.SIG_DFL:
            signal.signal(number, handler)
            signal.raise_signal(number)

    def __enter__(self) -> None:
        if threading.current_thread() is threading.main_thread():
            self._busy = True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if threading.current_thread() is threading.main_thread():
            self._busy = False
            while self._late:
                signal.raise_signal(self._late.pop(0))


UNINTERRUPTED = _Uninterrupted()
"""The one of this process: there is one handler of a signal, however many files are being written."""
