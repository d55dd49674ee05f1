"""Modes of an impact test: fitted where the exponential window has moved the poles, and moved back."""

from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.identify.impacts.reduction import ImpactResponses
from twin.identify.limits import LIMITS
from twin.identify.modes import ModalFit, Mode, fit_modes
from twin.identify.modes.shapes import mac_matrix, shape_of
from twin.identify.responses.reduction import resonances_of
from twin.identify.spectra.broadband import response_bins


def modes_of_impacts(responses: ImpactResponses) -> tuple[ModalFit, Array, tuple[str, ...]]:
    """The modes, the lines (k,) they were fitted to, and what is wrong with some.

    The residues of a mode are those of the channels at the first point, at the second, and so on.  The fit's poles are
    those of the windowed responses, the modes are the structure's.

    ValueError if there are too few lines, or no mode.
    """
    f, count = responses.frequency_Hz, len(responses.frequency_Hz)
    H, std = (each.reshape(count, -1) for each in (responses.H, responses.std))
    lines = response_bins(f, resonances_of(f, H))[:-1]
    fit = fit_modes(f[lines], H[lines], std[lines])
    modes, dropped = _without_satellites([_moved_back(mode, responses.rate_per_s) for mode in fit.modes])
    drowned = [
        f"{mode.frequency_Hz:.5g} Hz" for mode in modes
        if responses.rate_per_s > LIMITS.window_drowns * 2 * np.pi * mode.frequency_Hz * mode.damping_ratio
    ]  # fmt: skip
    notes = list(dropped)
    if drowned:
        notes.append(
            f"wrong window: it adds more than {LIMITS.window_drowns:g} times the damping that the mode"
            f"{'s' if len(drowned) > 1 else ''} at {', '.join(drowned)} has; take a longer record, and a weaker window"
        )
    return replace(fit, modes=tuple(modes)), lines, tuple(notes)


def _moved_back(mode: Mode, rate_per_s: float) -> Mode:
    pole = mode.pole + rate_per_s
    return replace(mode, frequency_Hz=float(abs(pole) / (2 * np.pi)), damping_ratio=float(-pole.real / abs(pole)))


def _without_satellites(modes: list[Mode]) -> tuple[list[Mode], list[str]]:
    """The modes without poles that make up for a sharper one's decay, and a line on each that had some.

    Such poles have its shape, or cancel each other and have none, out of phase from place to place; their residues are
    its own.
    """
    kept: list[Mode] = []
    beside: dict[int, int] = {}
    for mode in sorted(modes, key=lambda each: each.damping_ratio):
        for n, other in enumerate(kept):
            if abs(mode.frequency_Hz / other.frequency_Hz - 1) < LIMITS.satellite and _one_decay(mode, other):
                kept[n] = replace(other, residues=other.residues + mode.residues)
                beside[n] = beside.get(n, 0) + 1
                break
        else:
            kept.append(mode)
    told = [
        f"the decay at {kept[n].frequency_Hz:.5g} Hz is no single mode's, {count} more pole{'s' if count > 1 else ''} "
        "taken for the same: its frequency or damping follows the amplitude (hit softer), or a mass that roves"
        for n, count in beside.items()
    ]
    return sorted(kept, key=lambda each: each.frequency_Hz), told


def _one_decay(mode: Mode, other: Mode) -> bool:
    one, two = mode.residues[:, None], other.residues[:, None]
    scatter_deg = max(shape_of(each).phase_scatter_deg for each in (one, two))
    return bool(mac_matrix(one, two)[0, 0] > LIMITS.satellite_alike or scatter_deg > LIMITS.satellite_scatter_deg)
