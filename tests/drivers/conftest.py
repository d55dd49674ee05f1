"""Fuzzing without time limits for one example, as the machine may be busy; and turns on the multicast buses."""

import fcntl
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture
def multicast_alone():
    """One test at a time: other people's programs hear every multicast group that the machine has joined."""
    with (Path(tempfile.gettempdir()) / "tests-multicast.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
