"""What some tests need beside this package: where it is found, and what to install where it is missing."""

from __future__ import annotations

import shutil
import sys
import warnings
from collections import Counter
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

__all__ = ["missing_of", "needs", "package", "program"]

DEBIAN = {
    "bash": "bash", "ccx": "calculix-ccx", "chromium": "chromium", "git": "git", "java": "default-jre-headless",
    "pgrep": "procps", "socat": "socat", "a Vulkan driver": "mesa-vulkan-drivers",
}  # fmt: skip
"""Package of Debian that brings it; what is not here comes with a package of Python."""
_REASON = "missing: {what} ({how})"


def _found(name: str) -> str | None:
    """Where a program is: beside this Python first, as an environment need not be on PATH to be used."""
    beside = Path(sys.executable).with_name(name)
    return str(beside) if beside.exists() else shutil.which(name)


def _reason(what: str, extra: str) -> str:
    how = f"apt install {DEBIAN[what]}" if what in DEBIAN else f"pip install '.[{extra}]'"
    return _REASON.format(what=what, how=how)


def program(name: str) -> str:
    """The program's place; a test that runs where it is missing is skipped."""
    found = _found(name)
    if found is None:
        pytest.skip(_reason(name, "test"))
    return found


def package(name: str, extra: str = "test") -> ModuleType:
    """A package of one of the extras; a test that runs where it is missing is skipped."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what other people's imports warn of is no matter of ours
        try:
            return import_module(name)
        except ModuleNotFoundError:
            pytest.skip(_reason(name.partition(".")[0], extra))


def needs(name: str) -> pytest.MarkDecorator:
    """Mark for tests that need a program, or a Vulkan driver."""
    if name == "a Vulkan driver":
        there = any(Path("/usr/share/vulkan/icd.d").glob("*.json"))
    else:
        there = _found(name) is not None
    return pytest.mark.skipif(not there, reason=_reason(name, "test"))


def missing_of(reasons: Iterable[str]) -> list[str]:
    """What was missing according to the reasons of skipped tests, a line each."""
    count = Counter(reason.partition("missing: ")[2] for reason in reasons if "missing: " in reason)
    return [f"{what}: {number} test(s) skipped" for what, number in sorted(count.items())]
