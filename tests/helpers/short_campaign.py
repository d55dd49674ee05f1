"""A campaign as short as a diagnosis can do with: noise, sweeps at 1.5, 3 and 6 N, a held-out sweep at 4.5 N."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from recordings import RunWriter
from twin.bench import open_bench
from twin.procedures import DirectAcquisition, Random, SteppedSine, run_procedure
from twin.procedures.tables import Measure
from twin.rigs import Effect, Rig

__all__ = ["record_campaign"]


def record_campaign(
    folder: Path, rig: Rig, *, effects: Sequence[Effect] = (), store: Literal["settled", "all"] = "settled"
) -> Path:
    """Record the steel rig as it is, with hidden effects: ``random``, ``sweeps`` and ``heldout`` in the folder."""
    # Denser about the resonance, which is where the levels differ.
    frequencies = [25.6, 25.9, *np.round(np.arange(26.1, 26.8, 0.06), 3).tolist(), 27.0]
    measure = Measure(seconds=1.0)
    procedures = {
        "random": Random(band=(5.0, 1000.0), duration=30.0, rms=0.5),
        "sweeps": SteppedSine(frequencies=frequencies, amplitudes=[1.5, 3.0, 6.0], measure=measure, store=store),
        "heldout": SteppedSine(frequencies=frequencies, amplitudes=[4.5], measure=measure, store=store),
    }
    for seed, (name, procedure) in enumerate(procedures.items()):
        acquisition = DirectAcquisition(open_bench(rig, effects=effects, seed=seed))
        info = {"source": "simulated", "rig": rig.name, "preload_N": "120", "stored": procedure.store}
        with RunWriter(folder / f"{name}.mcap", info=info, channels=list(acquisition.channels)) as writer:
            assert run_procedure(procedure, acquisition, writer).state == "done"
    return folder
