"""The demonstration's runs: noise over the whole band, then sweeps about each resonance that it shows."""

from pathlib import Path

import numpy as np

from recordings.errors import InputError
from recordings.quantities import quantity
from recordings.run import Run
from twin.arrays import Array
from twin.identify.spectra.spectrum import broadband_records, h1
from twin.procedures import Random, SteppedSine, load_procedure
from twin.rigs import Rig
from twin.structure.modelled_rig import modelled_rig

BROADBAND, SWEEPS, HELD_OUT = "broadband.mcap", "run.mcap", "held-out.mcap"
"""Names of the recordings, those of sweeps about the first mode."""
FOLDER = Path(__file__).parent
LOWEST = 0.4
"""Where the first mode is sought, over where it is assumed; others between the middles to their neighbours."""
SEEN = 0.1
"""Motion of a sensor in a mode, over the largest of any, from which the mode is looked for there."""
HEADROOM = 0.92
"""Share of its range up to which a response may come."""
LINEAR_PEAK = 1.6
"""Share of a sensor's range to which the largest force would move it at a resonance if its joint lost nothing: one that
is driven so far loses a good part of it."""
WRITTEN_FOR_Hz = (26.3, 156.0, 470.0)
"""The steel rig's resonances that the sweeps' files are written for; another's mode takes those of the nearest."""


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


def resonance(run: Run, rig: Rig, *, mode: int = 1) -> float:
    """Frequency of one of a rig's modes in a broadband run, Hz.

    Raises
    ------
    InputError
        If the run holds no broadband stretch.
    """
    records = broadband_records(run)
    if not records:
        raise InputError(run.path, "", "holds no broadband stretch")
    natural, response = _nominal(rig, mode)
    below = LOWEST * natural[0] if mode == 1 else np.sqrt(natural[mode - 2] * natural[mode - 1])
    low, high = below, np.sqrt(natural[mode - 1] * natural[mode])
    shown = h1(records[0], force=rig.force_sensor.channel, resolution_Hz=0.1 if mode == 1 else 0.25)
    inside = np.flatnonzero((shown.frequency_Hz > low) & (shown.frequency_Hz < high))
    # A line of mains hum is no response to the force, and incoherent with it.
    peak = inside[np.argmax((np.abs(shown.H[response]) * shown.coherence[response])[inside])]
    return float(shown.frequency_Hz[peak])


def _largest_force(rig: Rig, mode: int) -> float:
    """Force that moves no sensor beyond a share of its range at a mode's resonance, N; the joint loses nothing."""
    modelled = modelled_rig(rig)
    omega, phi = modelled.modes.omega[mode - 1], modelled.modes.Phi[:, mode - 1]
    ratios = rig.damping.modal_ratio
    flexible = abs(modelled.structure.row(rig.drive_place) @ phi) / (2 * ratios[min(mode, len(ratios)) - 1] * omega**2)
    reach = []
    for sensor in rig.response_sensors:
        moved = abs(modelled.structure.row(rig.place_of(sensor.channel)) @ phi) * flexible
        reach.append(moved * omega ** quantity(sensor.quantity).derivative / sensor.range)
    return LINEAR_PEAK / max(reach)


def _nominal(rig: Rig, mode: int) -> tuple[Array, str]:
    """Natural frequencies as assumed, Hz, and the first response channel that moves in a mode."""
    modelled = modelled_rig(rig)
    rows = [modelled.structure.row(rig.place_of(sensor.channel)) for sensor in rig.response_sensors]
    motion = np.abs(np.array(rows) @ modelled.modes.Phi[:, mode - 1])
    moves = np.array([sensor.reads == "displacement" for sensor in rig.response_sensors])
    motion = np.where(moves, motion, 0.0) if np.any(moves) else motion
    chosen = int(np.argmax(motion >= SEEN * motion.max()))
    return modelled.modes.frequency_Hz, rig.response_sensors[chosen].channel


def planned_sweeps(rig: Rig, resonance_Hz: float, mode: int = 1) -> dict[str, SteppedSine]:
    """The sweeps to learn from and the one to be held out, about a resonance, by the names of their recordings.

    Their frequencies move with the resonance, in proportion, and no response may come to the end of its range.
    """
    nearest = int(np.argmin(np.abs(np.log(np.array(WRITTEN_FOR_Hz) / resonance_Hz))))
    number = "" if nearest == 0 else f"-{nearest + 1}"
    written = [_sweeps(f"{file}{number}.toml") for file in ("sweeps", "held-out")]
    share = min(1.0, _largest_force(rig, mode) / max(force for one in written for force in one.amplitudes))
    peak = {sensor.channel: HEADROOM * sensor.range for sensor in rig.response_sensors}
    peak[rig.force_sensor.channel] = written[0].limits.peak["force"]
    planned = {}
    for name, one in zip(recording_names(mode), written, strict=True):
        update = {
            "frequencies": [round(f * resonance_Hz / WRITTEN_FOR_Hz[nearest], 4) for f in one.frequencies],
            "amplitudes": [round(float(share * force), 4) for force in one.amplitudes],
            "limits": one.limits.model_copy(update={"peak": peak}),
        }
        planned[name] = one.model_copy(update=update)
    return planned


def _sweeps(file: str) -> SteppedSine:
    procedure = load_procedure(FOLDER / file)
    assert isinstance(procedure, SteppedSine)
    return procedure
