"""What holds for all tests."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from needed import missing_of

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")  # before numpy: small matrices, where threads only cost

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # As in a shell's background job; programs that tests start and interrupt would ignore it too.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    """How many changed recordings a night has time for."""
    parser.addoption("--mutations", type=int, default=2000, help="recordings of changed meaning in the nightly tests")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """With ``-n`` a file's tests stay together, and with them what they share, until a worker is idle."""
    if config.getoption("numprocesses", 0) and config.getoption("dist") == "no":
        config.option.dist = "worksteal"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes a night is slow too."""
    for item in items:
        if item.get_closest_marker("nightly"):
            item.add_marker("slow")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Iterator[None]:
    """Last of all, what to install for the tests that were skipped."""
    yield
    skipped = terminalreporter.stats.get("skipped", [])
    missing = missing_of(report.longrepr[2] for report in skipped if isinstance(report.longrepr, tuple))
    if missing:
        terminalreporter.section("missing here; with it the skipped tests run too")
        for line in missing:
            terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def installed_twin() -> str:
    """The command as it was installed.

    Not ``python -m twin``, which Python ends with the signal instead of the status where an interruption met an
    import that runs text (a shell shows 130 for either).
    """
    return str(Path(sys.executable).with_name("twin"))
