"""Whether a noise's resonances are those of the preload that the file names, or another one's of the rig."""

from collections.abc import Mapping, Sequence

import numpy as np

from twin.checks.expected import ExpectedResponse
from twin.checks.finding import Finding
from twin.checks.responses import NoiseResponse
from twin.checks.thresholds import CLEARER, OTHER_PRELOAD

MATCHED = 0.03
"""Relative distance within which a resonance that was found is one of the model's."""
SHARP = 1e-3
"""Relative error of a resonance, by the distance of the lines, up to which it takes part."""
FEWEST = 3
"""Resonances that tell moduli from anything else."""


def look_at_preload(
    noises: Sequence[NoiseResponse], by_preload: Mapping[str, ExpectedResponse], preload: str
) -> list[Finding]:
    """A line for each noise that fits another preload of the rig much better than the one it is taken at."""
    findings = []
    for noise in noises:
        apart = {name: _apart(noise, model) for name, model in by_preload.items()}
        best = min(apart, key=lambda name: apart[name][0])
        (own, over_unsure), (least, _) = apart[preload], apart[best]
        if np.isfinite(own) and over_unsure > OTHER_PRELOAD and own > CLEARER * least:
            found = f"noise {noise.sweep} has the resonances of {best}, {least:.2%} off, not {own:.2%}"
            expected = f"those of {preload}, which it is taken at"
            findings.append(Finding(noise.run, "", "preload", expected, found, "told"))
    return findings


def _apart(noise: NoiseResponse, model: ExpectedResponse) -> tuple[float, float]:
    """Median distance of the resonances that are the model's: relative, and over what it is unsure of.

    Infinite for too few.
    """
    found_Hz, own = noise.resonances_Hz, model.resonances_Hz
    if len(noise.frequency_Hz) < 2 or not len(found_Hz):
        return np.inf, np.inf
    spacing_Hz = noise.frequency_Hz[1] - noise.frequency_Hz[0]
    used = (own < model.reach_Hz) & (spacing_Hz / 2 < SHARP * own)
    if not used.any():
        return np.inf, np.inf
    apart = np.min(np.abs(np.log(found_Hz[None, :] / own[used, None])), axis=1)
    near = apart < MATCHED
    if near.sum() < FEWEST:
        return np.inf, np.inf
    return float(np.median(apart[near])), float(np.median((apart / model.unsure[used])[near]))
