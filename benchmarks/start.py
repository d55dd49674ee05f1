"""From nothing to the first samples and branches: with every kernel to be compiled, and with all of them on disk."""

import os
import subprocess
import sys
import tempfile
import time

from benchmarks.measured import Measured

FIRST_RESULTS = """
import time
from twin.bench import open_bench
from twin.procedures import load_procedure
from twin.rehearsal import predicted_branches
from twin.rigs import load_rig
rig = load_rig("steel-lap-joint")
open_bench(rig).read(256)
print(time.time())
predicted_branches(rig, preload="120N", procedure=load_procedure("steel-sweeps"))
print(time.time())
"""


def start() -> Measured:
    """A fresh process each, the first with an empty cache of kernels."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        cold, cached = (_seconds(environment) for _ in range(2))
    return Measured(
        ratio=cold[0] / cached[0], promise=None, against="a start with cached kernels, to the first samples", error=0.0,
        more={"cold_s": cold[0], "cached_s": cached[0], "branches_cold_s": cold[1], "branches_cached_s": cached[1]},
    )  # fmt: skip


def _seconds(environment: dict[str, str]) -> tuple[float, float]:
    """To the bench's first samples, and to a rehearsal's predicted branches."""
    begun = time.time()
    process = subprocess.run(
        [sys.executable, "-c", FIRST_RESULTS], env=environment, check=True, timeout=900, stdout=subprocess.PIPE
    )
    samples, branches = (float(line) - begun for line in process.stdout.split())
    return samples, branches
