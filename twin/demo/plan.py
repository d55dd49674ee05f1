"""The demonstration's runs: noise over the whole band, then sweeps about the resonance that it shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from recordings.errors import InputError
from recordings.run import Run
from twin.identify.spectrum import broadband_records, h1
from twin.procedures import Random, SteppedSine, load_procedure

__all__ = ["BROADBAND", "HELD_OUT", "SWEEPS", "broadband", "first_resonance", "planned_sweeps"]

BROADBAND, SWEEPS, HELD_OUT = "broadband.mcap", "run.mcap", "held-out.mcap"
"""Names of the recordings."""
FOLDER = Path(__file__).parent
MODE_1_Hz = (10.0, 60.0)
"""Where mode 1 is sought: below, the acceleration is mere noise; above, mode 2 may lie."""
WRITTEN_FOR_Hz = 26.3
"""The resonance that the sweeps' files are written for."""


def broadband() -> Random:
    """Random noise over the first four modes."""
    procedure = load_procedure(FOLDER / "broadband.toml")
    assert isinstance(procedure, Random)
    return procedure


def first_resonance(run: Run, *, force: str, response: str) -> float:
    """Frequency of mode 1 in a broadband run, Hz.

    Raises
    ------
    InputError
        If the run holds no broadband stretch.
    """
    records = broadband_records(run)
    if not records:
        raise InputError(run.path, "", "holds no broadband stretch")
    shown = h1(records[0], force=force, resolution_Hz=0.1)
    inside = np.flatnonzero((shown.frequency_Hz > MODE_1_Hz[0]) & (shown.frequency_Hz < MODE_1_Hz[1]))
    # A line of mains hum is no response to the force, and incoherent with it.
    peak = inside[np.argmax((np.abs(shown.H[response]) * shown.coherence[response])[inside])]
    return float(shown.frequency_Hz[peak])


def planned_sweeps(resonance_Hz: float) -> dict[str, SteppedSine]:
    """The sweeps to learn from and the one to be held out, about a resonance, by the names of their recordings.

    Their frequencies move with the resonance, in proportion.
    """
    planned = {}
    for name, file in ((SWEEPS, "sweeps.toml"), (HELD_OUT, "held-out.toml")):
        procedure = load_procedure(FOLDER / file)
        assert isinstance(procedure, SteppedSine)
        frequencies = [round(f * resonance_Hz / WRITTEN_FOR_Hz, 4) for f in procedure.frequencies]
        planned[name] = procedure.model_copy(update={"frequencies": frequencies})
    return planned
