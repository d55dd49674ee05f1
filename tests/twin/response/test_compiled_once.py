"""Every kernel is compiled for one kind of arguments: a second one is seconds more at the first start, and no use."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from benchmarks.start import FIRST_RESULTS

SPECIALISATIONS = """
import sys
from numba.core.dispatcher import Dispatcher
for name in [name for name in sys.modules if name.startswith("twin.")]:
    for value in vars(sys.modules[name]).values():
        if isinstance(value, Dispatcher) and value.__module__ == name:
            print(f"{name}.{value.__name__}", len(value.signatures))
"""


@pytest.mark.slow
def test_a_first_start_compiles_each_kernel_for_one_kind_of_arguments(tmp_path):
    process = subprocess.run(
        [sys.executable, "-c", FIRST_RESULTS + SPECIALISATIONS],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}, check=True, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    compiled = dict(line.split() for line in process.stdout.splitlines()[2:])
    assert compiled["twin.response.continuation.follow"] == compiled["twin.bench.marching._integrate"] == "1"
    assert {name for name, count in compiled.items() if int(count) > 1} == set()
