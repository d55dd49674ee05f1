"""Broadband runs binned anew against a model that has been extended.

Bins assume that the response less a reference is smooth; a reference that lacks what the rig has, such as a heavy
sensor elsewhere, bends the bins at the resonances and makes them look noisy.
"""

from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.broadband_response import in_noise, noise_motion
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import bin_broadband
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.spectra.broadband import BinnedResponse


def rebinned(evidence: MeasuredData, modification: ModelModification, baseline: BaselineParameters) -> MeasuredData:
    """The evidence with its broadband runs binned against the extended model."""
    if not evidence.runs:
        return evidence  # frequency responses have no samples behind them
    residual_model = ResidualModel(evidence, modification)
    anew = []
    for record, data in zip(evidence.records(), evidence.broadband, strict=True):

        def reference(omega: Array, data: BinnedResponse = data) -> Array:
            return _responses(residual_model, data, baseline, omega)

        bins = bin_broadband(
            evidence.model, record, baseline.base,
            force=evidence.force, reference=reference, resonances_Hz=data.resonances_Hz,
        )  # fmt: skip
        anew.append(replace(bins, drive=data.drive))
    return replace(evidence, broadband=tuple(anew))


def _responses(
    residual_model: ResidualModel, data: BinnedResponse, baseline: BaselineParameters, omega: Array
) -> Array:
    """Responses (f, o) at any omega, as the extended model has them in this run's noise."""
    motion = None
    if residual_model.local.act_in_noise:
        motion = noise_motion(residual_model, *residual_model.broadband_receptance(data, baseline, data.omega), data)
    parts = []
    for some in np.array_split(omega, max(1, len(omega) // LIMITS.lines_at_once)):
        R, clocked = residual_model.broadband_receptance(data, baseline, some)
        if motion is not None:
            R = in_noise(residual_model, R, clocked, motion)
        parts.append(residual_model.responses(R, clocked))
    return np.concatenate(parts)
