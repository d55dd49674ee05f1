"""Questions and answers in plain text over a line."""

import time

from drivers.host.transport import Transport

QUIET_S = 0.05
ANSWER_LIMIT = 1 << 20


def ask_line(line: Transport, text: str, *, timeout_s: float) -> str:
    """Send a line, and wait for one.

    Raises
    ------
    TimeoutError
        If none comes in time, or one without end.
    LineLostError
        If the far end has gone.
    """
    line.write(text.encode() + b"\n")
    answer = bytearray()
    deadline = time.monotonic() + timeout_s
    while not answer.endswith(b"\n"):
        left = deadline - time.monotonic()
        if left <= 0 or len(answer) > ANSWER_LIMIT:
            raise TimeoutError(f"no answer to {text!r} within {timeout_s:g} s")
        answer += line.read(left)
    return answer.decode("latin-1").strip()


def drain(line: Transport, *, timeout_s: float) -> None:
    """Throw away what still comes, until it is quiet."""
    deadline = time.monotonic() + timeout_s
    while line.read(QUIET_S) and time.monotonic() < deadline:
        pass
