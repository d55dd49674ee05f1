"""Diagnose a short campaign in a process of its own: python diagnose_perturbed.py FOLDER NOISE PROCESSES.

Samples are multiplied by 1 + NOISE times a normal number.  What was found is printed as JSON.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np

from recordings import Run, read_run
from twin.diagnose import diagnose
from twin.rigs import load_rig


def perturb(size: float) -> None:
    """Let every run give its samples so from now on."""
    plain, rng = Run.between, np.random.default_rng(1)

    def between(self, *where):
        samples = plain(self, *where)
        return samples * (1 + size * rng.standard_normal(samples.shape))

    Run.between = between


def main(folder: Path, noise: float, processes: int) -> None:
    """Print the answer."""
    if noise:
        perturb(noise)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:processes])
    runs = [read_run(folder / f"{name}.mcap") for name in ("random", "sweeps")]
    found = diagnose(runs, load_rig("steel-lap-joint"), held_out=[read_run(folder / "heldout.mcap")])
    causes = {
        cause.cause: {
            name: [estimate.value, estimate.std]
            for name, estimate in cause.parameters.items()
            if hasattr(estimate, "std")
        }
        for cause in found.causes
        if cause.in_model
    }
    print(json.dumps({"verdict": found.verdict, "causes": causes, "chi2": found.misfit.after}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))
