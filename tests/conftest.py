"""What holds for all tests."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")  # before numpy: small matrices, where threads only cost

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # As in a shell's background job; programs that tests start and interrupt would ignore it too.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def installed_twin() -> str:
    """The command as it was installed.

    Not ``python -m twin``, which Python ends with the signal instead of the status where an interruption met an
    import that runs text (a shell shows 130 for either).
    """
    return str(Path(sys.executable).with_name("twin"))
