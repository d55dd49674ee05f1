"""The demonstration's runs: noise over the whole band, then sweeps about each resonance that it shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from recordings.errors import InputError
from recordings.run import Run
from twin.identify.spectrum import broadband_records, h1
from twin.procedures import Random, SteppedSine, load_procedure

__all__ = [
    "BROADBAND", "HELD_OUT", "SWEEPS", "broadband", "planned_sweeps", "recording_names", "resonance",
]  # fmt: skip

BROADBAND, SWEEPS, HELD_OUT = "broadband.mcap", "run.mcap", "held-out.mcap"
"""Names of the recordings, those of sweeps about the first mode."""
FOLDER = Path(__file__).parent
SOUGHT_Hz = ((10.0, 60.0), (110.0, 220.0), (340.0, 640.0))
"""Where each mode is sought: below the first the acceleration is mere noise, and between them lies none."""
WRITTEN_FOR_Hz = (26.3, 156.0, 470.0)
"""Each mode's resonance that its sweeps' files are written for."""


def broadband() -> Random:
    """Random noise over the first four modes."""
    procedure = load_procedure(FOLDER / "broadband.toml")
    assert isinstance(procedure, Random)
    return procedure


def recording_names(mode: int) -> tuple[str, str]:
    """Names of the recordings of a mode's sweeps, and of the sweep that is held out."""
    if mode == 1:
        return SWEEPS, HELD_OUT
    return SWEEPS.replace(".", f"-{mode}."), HELD_OUT.replace(".", f"-{mode}.")


def resonance(run: Run, *, force: str, response: str, mode: int = 1) -> float:
    """Frequency of one of the first three modes in a broadband run, Hz.

    Raises
    ------
    InputError
        If the run holds no broadband stretch.
    """
    records = broadband_records(run)
    if not records:
        raise InputError(run.path, "", "holds no broadband stretch")
    shown = h1(records[0], force=force, resolution_Hz=0.1 if mode == 1 else 0.25)
    low, high = SOUGHT_Hz[mode - 1]
    inside = np.flatnonzero((shown.frequency_Hz > low) & (shown.frequency_Hz < high))
    # A line of mains hum is no response to the force, and incoherent with it.
    peak = inside[np.argmax((np.abs(shown.H[response]) * shown.coherence[response])[inside])]
    return float(shown.frequency_Hz[peak])


def planned_sweeps(resonance_Hz: float, mode: int = 1) -> dict[str, SteppedSine]:
    """The sweeps to learn from and the one to be held out, about a resonance, by the names of their recordings.

    Their frequencies move with the resonance, in proportion.
    """
    planned = {}
    number = "" if mode == 1 else f"-{mode}"
    for name, file in zip(recording_names(mode), (f"sweeps{number}.toml", f"held-out{number}.toml"), strict=True):
        procedure = load_procedure(FOLDER / file)
        assert isinstance(procedure, SteppedSine)
        frequencies = [round(f * resonance_Hz / WRITTEN_FOR_Hz[mode - 1], 4) for f in procedure.frequencies]
        planned[name] = procedure.model_copy(update={"frequencies": frequencies})
    return planned
