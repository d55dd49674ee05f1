"""A thinner copy of the evidence, for the search's first passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.identify.measured_data import MeasuredData
from twin.identify.whitening import HarmonicResiduals

__all__ = ["thinned_data"]


def thinned_data(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, *, bins: int = 140, steps: int = 50
) -> tuple[MeasuredData, HarmonicResiduals | None]:
    """Keep about `bins` broadband bins and `steps` steps, evenly picked."""
    broadband = []
    for data in evidence.broadband:
        every = max(1, round(len(data.frequency_Hz) / bins))
        picked = np.arange(every // 2, len(data.frequency_Hz), every)
        # A kept bin stands for its neighbours too: the response keeps its power.
        size = np.sum(np.abs(data.H) ** 2, axis=1)
        power = np.add.reduceat(data.force_power * size, picked - every // 2)
        broadband.append(
            replace(
                data,
                frequency_Hz=data.frequency_Hz[picked],
                H=data.H[picked],
                relative_covariance=data.relative_covariance[picked],
                distortion=data.distortion[picked],
                force_power=power / size[picked],
            )
        )
    count = len(evidence.steps)
    keep = np.arange(count) % max(1, round(count / steps)) == 0
    thinner = replace(evidence, broadband=tuple(broadband), steps=evidence.steps.select(keep))
    return thinner, harmonics.select(keep) if harmonics is not None else None
