"""Modes of a broadband record, without a model of the structure.

H1 with a window begins; what leakage and averaging cost there is won back on the record's own spectral lines, whose
decays at both ends are taken off with the poles found so far (:mod:`twin.identify.spectra.broadband`).
"""

import numpy as np

from twin.identify.limits import LIMITS
from twin.identify.modes.fit import ModalFit, fit_modes
from twin.identify.spectra.broadband import BinnedResponse, Binning, bin_response, find_resonances
from twin.identify.spectra.spectrum import BroadbandRecord, h1

ROUNDS = 2


def modes_of_record(
    record: BroadbandRecord, *, force: str, channels: tuple[str, ...], band_Hz: tuple[float, float] | None = None
) -> tuple[ModalFit, BinnedResponse]:
    """The modes that a record shows, and the responses that they were fitted to.

    Parameters
    ----------
    force, channels
        Names of the force and of the responses.
    band_Hz
        Where to look; where the force excites if not given.

    Raises
    ------
    ValueError
        If the band holds too few lines or no mode.
    """
    resonances, excited = find_resonances(record, force=force, channels=channels)
    band = excited if band_Hz is None else np.array([max(band_Hz[0], excited[0]), min(band_Hz[1], excited[1])])
    part_s = record.part_length / record.sample_rate_Hz
    rough = h1(record, force=force, resolution_Hz=LIMITS.from_record_averages / part_s)
    inside = (rough.frequency_Hz > max(band[0], 0.0)) & (rough.frequency_Hz < band[1])
    fit = fit_modes(rough.frequency_Hz[inside], np.stack([rough.H[c][inside] for c in channels], axis=1))
    for _ in range(ROUNDS):
        found = fit.fit
        binning = Binning(
            force=force, channels=channels, reference=found.responses, poles=found.poles,
            resonances_Hz=np.concatenate([resonances, found.omega / (2 * np.pi)]), band_Hz=band,
        )  # fmt: skip
        response = bin_response(record, binning)
        variance = np.einsum("foo->fo", response.relative_covariance).real
        fit = fit_modes(response.frequency_Hz, response.H, np.sqrt(variance) * np.abs(response.H))
    return fit, response
