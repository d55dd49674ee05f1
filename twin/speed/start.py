"""From nothing to the first samples: with every kernel to be compiled, and with all of them on disk."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from twin.speed.measured import Measured

__all__ = ["start"]

FIRST_SAMPLES = """
from twin.bench import open_bench
from twin.rigs import load_rig
open_bench(load_rig("steel-lap-joint")).read(256)
"""


def start() -> Measured:
    """A fresh process each, the first with an empty cache of kernels."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        cold, cached = (_seconds(environment) for _ in range(2))
    return Measured(
        ratio=cold / cached, promise=None, against="a start with cached kernels, to the first samples", error=0.0,
        more={"cold_s": cold, "cached_s": cached},
    )  # fmt: skip


def _seconds(environment: dict[str, str]) -> float:
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-c", FIRST_SAMPLES], env=environment, check=True, timeout=600)
    return time.perf_counter() - begun
