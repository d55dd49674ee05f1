"""What a rehearsal's noise shows: densities, responses, coherence, modes, and whether it lasted long enough."""

from pathlib import Path
from typing import Any

import numpy as np

from recordings import read_run
from twin.arrays import Array
from twin.identify.modes.from_record import modes_of_record
from twin.identify.spectra.spectrum import BroadbandRecord, broadband_records, h1
from twin.rehearsal.checks.too_short import averages
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Rehearsal


def noise_tables(rehearsal: Rehearsal, recording: Path) -> list[dict[str, Any]]:
    """A table for each stretch of noise in a rehearsal's recording; none of a procedure that makes no noise."""
    band = getattr(rehearsal.procedure, "band", None)
    force = rehearsal.force_channel
    if band is None or force is None or not any(step.frequency_Hz == 0 for step in rehearsal.result.steps):
        return []
    channels = (force, *rehearsal.response_channels)
    return [_table(rehearsal, record, band) for record in broadband_records(read_run(recording), channels=channels)]


def _table(rehearsal: Rehearsal, record: BroadbandRecord, band: tuple[float, float]) -> dict[str, Any]:
    force, channels = rehearsal.force_channel, tuple(rehearsal.response_channels)
    assert force is not None
    resolution_Hz = max(LIMITS.noise_averages / record.duration_s, (band[1] - band[0]) / LIMITS.most_lines)
    seen = h1(record, force=force, resolution_Hz=resolution_Hz)
    inside = (seen.frequency_Hz >= band[0]) & (seen.frequency_Hz <= band[1]) & (seen.frequency_Hz > 0)
    table = {
        "sweep": record.sweep,
        "duration_s": record.duration_s,
        "resolution_Hz": resolution_Hz,
        "frequency_Hz": _rounded(seen.frequency_Hz[inside]),
        "density": {name: _rounded(seen.density[name][inside]) for name in (force, *channels)},
        "response": {name: _rounded(np.abs(seen.H[name][inside])) for name in channels},
        "coherence": {name: _rounded(seen.coherence[name][inside]) for name in channels},
        "modes": _modes(record, force, channels, band),
        "lowest_mode": None,
    }
    if rehearsal.lowest_mode is not None:
        frequency_Hz, ratio = rehearsal.lowest_mode
        count = averages(record.duration_s, frequency_Hz, ratio)
        table["lowest_mode"] = {"frequency_Hz": frequency_Hz, "width_Hz": 2 * ratio * frequency_Hz, "averages": count}
    return table


def _modes(
    record: BroadbandRecord, force: str, channels: tuple[str, ...], band: tuple[float, float]
) -> list[dict[str, float]]:
    try:
        fit, _ = modes_of_record(record, force=force, channels=channels, band_Hz=band)
    except (ValueError, np.linalg.LinAlgError):  # too few lines, or nothing that resonates
        return []
    return [
        {
            "frequency_Hz": mode.frequency_Hz, "frequency_std_Hz": mode.frequency_std_Hz,
            "damping_ratio": mode.damping_ratio, "damping_std": mode.damping_std,
        }
        for mode in fit.modes
    ]  # fmt: skip


def _rounded(values: Array) -> list[float]:
    """As far as a picture shows them."""
    return [float(f"{value:.5g}") for value in values]
