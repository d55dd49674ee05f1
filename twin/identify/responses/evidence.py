"""Measured frequency responses of one state of a rig, as the evidence that identification and diagnosis see."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from recordings.responses import Responses
from twin.arrays import Array
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.linear.linear_fit import LinearFit, highest_Hz
from twin.identify.linear.linear_model import (
    LinearModel,
    LinearParameters,
    Output,
    build_linear_model,
    nominal_parameters,
)
from twin.identify.measured_data import MeasuredData, no_steps, reference_output
from twin.identify.responses.following import Followed, follow
from twin.identify.responses.limits import LIMITS
from twin.identify.responses.matching import Matched, match_responses
from twin.identify.responses.reduction import reduce_responses
from twin.identify.spectra.broadband import BinnedResponse
from twin.rigs import Rig, preload_name


@dataclass(frozen=True)
class Gathered:
    """What was measured of a state."""

    evidence: MeasuredData
    notes: tuple[str, ...]
    """What an engineer should know of the data."""
    factors: tuple[tuple[float, ...], ...]
    """What each output shows of each mode over what its place says, see
    :class:`~twin.identify.linear.linear_model.Output`."""
    shown: NDArray[np.bool_]
    """Which modes lie in the measured band, (m,)."""
    scatter: float
    """Relative standard deviation of natural frequencies from case to case."""
    damping_std: Array
    """Of the logarithms of the damping ratios, (m,)."""


@dataclass(frozen=True)
class Case:
    """One measurement of the state: responses of distinct channels."""

    path: str
    matched: tuple[Matched, ...]


def gather_responses(
    files: Sequence[Responses], rig: Rig, *, preload: str | None = None, scatter: float | None = None
) -> Gathered:
    """Reduce frequency responses of one state, measured once or several times, against `rig`.

    Parameters
    ----------
    files
        A response of the same channel that comes again, in a file or in another one, is another case.
    preload
        State of the rig's joints; its first if not given.
    scatter
        Relative standard deviation of a natural frequency from case to case; the rig file's, or that of the cases if
        they are enough, where it is not given.

    Raises
    ------
    InputError
        If nothing belongs to the rig's channels or stands out of its noise.
    """
    preload = preload or preload_name(rig)
    cases, told = _cases(files, rig)
    outputs = _outputs(cases, rig)
    channels = [output.channel for output in outputs]
    model = build_linear_model(rig, list(outputs), preload=preload)
    nominal = nominal_parameters(rig, preload)
    band = (LIMITS.evidence_lowest * float(model.basis.omega[0]) / (2 * np.pi), highest_Hz(model))
    fits = []
    for case in cases:
        data = reduce_responses(case.path, case.matched, channels, band_Hz=band)
        fits.append((data, follow(model, data, nominal)))
    runs, base, factors = _beside_each_other(fits)
    chi2 = float(np.mean([fit.chi2_per_dof for _, fit in fits]))
    own = _scatter(runs, model)
    known = scatter if scatter is not None else rig.natural_frequencies.scatter or own or LIMITS.scatter
    of_cases = own if scatter is None and not rig.natural_frequencies.scatter else None
    told += (
        f"natural frequencies scatter by {100 * known:.2g} % among the {len(runs)} cases"
        if of_cases
        else f"natural frequencies are taken to scatter by {100 * known:.2g} % from case to case",
    )
    start = LinearFit(base=base, covariance=np.zeros((0, 0)), chi2_per_dof=chi2, nominal=nominal)
    evidence = MeasuredData(
        rig=rig, preload=preload, model=model, outputs=outputs, force=rig.force_sensor.channel,
        reference=reference_output(model), broadband=runs, steps=no_steps(len(outputs)), unsettled=(), linear=start,
        runs=(), begun_s=0.0,
        frequency_scatter=float(np.hypot(known / len(runs) ** 0.5, rig.natural_frequencies.offset_std)),
        shape_error=LIMITS.shape_again if all(output.modal_factor for output in outputs) else LIMITS.shape,
    )  # fmt: skip
    first, last = max(run.frequency_Hz[0] for run in runs), min(run.frequency_Hz[-1] for run in runs)
    shown_Hz = model.basis.omega[: IDENTIFY.damped_modes] / (2 * np.pi) * np.sqrt(1 + 2 * base.frequency_discrepancy)
    std = np.mean([fit.damping_std for _, fit in fits], axis=0) / len(fits) ** 0.5
    return Gathered(evidence, told, factors, (shown_Hz > first) & (shown_Hz < last), known, std)


def _cases(files: Sequence[Responses], rig: Rig) -> tuple[list[Case], tuple[str, ...]]:
    """Responses sorted into cases, each of distinct channels."""
    cases, told = [], []
    for file in files:
        matched, lines = match_responses(file, rig)
        told += [f"{file.path}: {line}" for line in lines]
        own: list[dict[str, Matched]] = []
        for one in matched:
            place = next((case for case in own if one.channel not in case), None)
            if place is None:
                own.append(place := {})
            place[one.channel] = one
        cases += [Case(file.path, tuple(case.values())) for case in own]
    return cases, tuple(told)


def _outputs(cases: Sequence[Case], rig: Rig) -> tuple[Output, ...]:
    """The channels that all cases have."""
    common = set.intersection(*({one.channel for one in case.matched} for case in cases))
    outputs = []
    for sensor in rig.response_sensors:
        if sensor.channel not in common:
            continue
        said = {one.found.quantity for case in cases for one in case.matched if one.channel == sensor.channel} - {""}
        if len(said) > 1:
            reason = f"{sensor.channel} is measured as {' and as '.join(sorted(said))}"
            raise InputError(cases[-1].path, f"channel {sensor.channel}", reason, "export all cases alike")
        measured = next(iter(said), sensor.quantity)
        outputs.append(Output(sensor.channel, measured, rig.place_of(sensor.channel), 1.0, tuple(sensor.modal_factor)))
    if not outputs:
        raise InputError(cases[-1].path, "", "shares no response channel with the other files", "give them apart")
    return tuple(outputs)


def _beside_each_other(
    fits: Sequence[tuple[BinnedResponse, Followed]],
) -> tuple[tuple[BinnedResponse, ...], LinearParameters, tuple[tuple[float, ...], ...]]:
    """Each case with its natural frequencies' offsets from the mean of all; that mean, and that of modal factors."""
    offsets = np.array([fit.base.frequency_discrepancy for _, fit in fits])
    mean = offsets.mean(axis=0)
    runs = tuple(replace(data, frequency_offset=own - mean) for (data, _), own in zip(fits, offsets, strict=True))
    zeta = np.exp(np.mean([np.log(fit.base.zeta) for _, fit in fits], axis=0))
    factors = np.exp(np.mean([np.log(fit.factors) for _, fit in fits], axis=0))
    base = replace(fits[-1][1].base, frequency_discrepancy=mean, zeta=zeta)
    return runs, base, tuple(tuple(map(float, row)) for row in factors)


def _scatter(runs: Sequence[BinnedResponse], model: LinearModel) -> float | None:
    """Of the natural frequencies that the cases show, if these are enough."""
    if len(runs) < LIMITS.known_cases:
        return None
    shown = model.basis.omega[: IDENTIFY.damped_modes] / (2 * np.pi) < runs[0].frequency_Hz[-1]
    offsets = np.array([np.asarray(run.frequency_offset)[shown] for run in runs])
    return max(LIMITS.scatter, float(np.sqrt(np.sum(offsets**2) / (offsets.shape[1] * (len(runs) - 1)))))
