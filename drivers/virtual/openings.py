"""Who opens and closes a terminal, by inotify: a client that goes and another that comes at once are two."""

import ctypes
import os
import struct

CLOSED, OPENED = 0x08 | 0x10, 0x20
"""The kernel's bits IN_CLOSE_WRITE with IN_CLOSE_NOWRITE, and IN_OPEN."""
_EVENT = struct.Struct("iIII")
READ_BYTES = 4096


class Openings:
    """Watches one path.  Where the kernel has no watch to spare it sees nothing, and hang-ups alone are noticed.

    Attributes
    ----------
    descriptor
        Ready to be read when something has happened; -1 without a watch.
    """

    def __init__(self, path: str) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self.descriptor: int = self._libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self.descriptor >= 0:
            self._libc.inotify_add_watch(self.descriptor, os.fsencode(path), CLOSED | OPENED)

    def take(self) -> list[bool]:
        """What has happened since the last call, in order: opened (True) or closed."""
        if self.descriptor < 0:
            return []
        try:
            data = os.read(self.descriptor, READ_BYTES)
        except BlockingIOError:
            return []
        found, position = [], 0
        while position < len(data):
            _, mask, _, length = _EVENT.unpack_from(data, position)
            position += _EVENT.size + length
            if mask & (CLOSED | OPENED):
                found.append(bool(mask & OPENED))
        return found

    def close(self) -> None:
        """Stop watching."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
