"""Broadband runs binned anew against a model that has been extended.

Bins assume that the response less a reference is smooth; a reference that lacks what the rig has, such as a heavy
sensor elsewhere, bends the bins at the resonances and makes them look noisy.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.broadband import BinnedResponse
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.linear_fit import bin_broadband
from twin.identify.prediction import Predictor
from twin.identify.unknowns import Unknowns

__all__ = ["rebinned"]

Array = NDArray[Any]

LINES_AT_ONCE = 4096
"""Spectral lines whose receptances are held in memory together."""


def rebinned(evidence: Evidence, extension: Extension, unknowns: Unknowns) -> Evidence:
    """The evidence with its broadband runs binned against the extended model."""
    predictor = Predictor(evidence, extension)
    anew = []
    for record, data in zip(evidence.records(), evidence.broadband, strict=True):

        def reference(omega: Array, data: BinnedResponse = data) -> Array:
            return _responses(predictor, data, unknowns, omega)

        anew.append(
            bin_broadband(
                evidence.model,
                record,
                unknowns.base,
                force=evidence.force,
                reference=reference,
                resonances_Hz=data.resonances_Hz,
            )
        )
    return replace(evidence, broadband=tuple(anew))


def _responses(predictor: Predictor, data: BinnedResponse, unknowns: Unknowns, omega: Array) -> Array:
    """Responses (f, o) at any omega, as the extended model has them in this run's noise."""
    motion = None
    if predictor.local.act_in_noise:
        motion = predictor.noise_motion(*predictor.broadband_receptance(data, unknowns, data.omega), data)
    parts = []
    for some in np.array_split(omega, max(1, len(omega) // LINES_AT_ONCE)):
        R, clocked = predictor.broadband_receptance(data, unknowns, some)
        if motion is not None:
            R = predictor.in_noise(R, clocked, motion)
        parts.append(predictor.responses(R, clocked))
    return np.concatenate(parts)
