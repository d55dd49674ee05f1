"""Modes and responses of a broadband record, without a model of the structure.

H1 with a window begins; what leakage and averaging cost there is won back on the record's own spectral lines, whose
decays at both ends are taken off with the poles found so far (:mod:`twin.identify.spectra.broadband`).
"""

from collections.abc import Callable

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.modes.fit import HIGHEST_ORDER, ModalFit, fit_modes
from twin.identify.spectra.broadband import (
    BinnedResponse,
    Binning,
    bin_response,
    find_resonances,
    hidden_resonances,
)
from twin.identify.spectra.driven_gaps import driven_through
from twin.identify.spectra.spectrum import BroadbandRecord, h1

Responses = Callable[[Array], Array]
"""Responses (f, o) at omega (f,)."""
NO_POLES = np.zeros(0, complex)


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
    response = response_of_record(record, force=force, channels=channels, band_Hz=band_Hz)
    return fit_modes(response.frequency_Hz, response.H, np.sqrt(response.variance) * np.abs(response.H)), response


def response_of_record(
    record: BroadbandRecord, *, force: str, channels: tuple[str, ...], band_Hz: tuple[float, float] | None = None,
    highest_order: int = HIGHEST_ORDER,
) -> BinnedResponse:  # fmt: skip
    """The responses alone, about modes of which `highest_order` is as for :func:`~twin.identify.modes.fit.fit_modes`.

    ValueError if the band holds too few lines.
    """
    resonances, excited = find_resonances(record, force=force, channels=channels)
    band = excited if band_Hz is None else np.array([max(band_Hz[0], excited[0]), min(band_Hz[1], excited[1])])
    rough = h1(
        record, force=force, resolution_Hz=LIMITS.from_record_averages * record.sample_rate_Hz / record.part_length
    )
    inside = (rough.frequency_Hz > max(band[0], 0.0)) & (rough.frequency_Hz < band[1])
    frequency_Hz, H = rough.frequency_Hz[inside], np.stack([rough.H[c][inside] for c in channels], axis=1)
    std, found, poles = None, None, NO_POLES
    for _ in range(LIMITS.from_record_rounds):
        before, reference = poles, _interpolated(frequency_Hz, H)
        try:
            found = fit_modes(frequency_Hz, H, std, highest_order=highest_order, begun=found).fit
        except ValueError:  # noise hides all modes
            found, poles = None, NO_POLES
        else:
            reference, poles = found.responses, found.poles
            if _settled(before, poles):
                break

        def mended(part: BroadbandRecord, reference: Responses = reference) -> BroadbandRecord:
            return driven_through(part, reference, force=force, channels=channels, up_to_Hz=float(band[1]))

        binning = Binning(
            force=force, channels=channels, reference=reference, poles=poles, band_Hz=band, mended=mended,
            resonances_Hz=np.concatenate([resonances, poles.imag / (2 * np.pi)]),
        )  # fmt: skip
        response = bin_response(record, binning)
        resonances = np.concatenate([resonances, hidden_resonances(response)])
        frequency_Hz, H = response.frequency_Hz, response.H
        std = np.sqrt(response.variance) * np.abs(H)
    return response


def _interpolated(frequency_Hz: Array, H: Array) -> Responses:
    return lambda omega: np.stack([np.interp(omega / (2 * np.pi), frequency_Hz, h) for h in H.T], axis=1)


def _settled(before: Array, poles: Array) -> bool:
    """Whether no pole has moved by a good part of its half width: the decays taken off have not either."""
    if len(before) != len(poles):
        return False
    one, other = (each[np.argsort(each.imag)] for each in (before, poles))
    return bool(np.all(np.abs(other - one) < LIMITS.from_record_moved * np.abs(other.real)))
