"""Procedures that might tell rivals apart: bands of noise, sweeps at several forces, each for several lengths."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from recordings.level import Level
from recordings.run import Run
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.next_test.limits import LIMITS
from twin.diagnose.next_test.sweeps import sweep_bands
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.measured_data import MeasuredData
from twin.procedures import Procedure, Random, SteppedSine
from twin.procedures.tables import Limits, Measure, Settle
from twin.rigs import Rig

LONGEST_WAIT_s = 60.0


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """A procedure with what it costs."""

    what: str
    procedure: Procedure
    longer: float
    """Measuring time over that of the recordings it resembles."""
    rig_time_s: float


def propose(runs: Sequence[Run], evidence: MeasuredData, model: FittedModel, *, drifting: bool) -> list[Proposal]:
    """All proposals, the shortest first.

    Parameters
    ----------
    runs
        The recordings, for forces, rates and lengths that were used.
    model
        The best one, for the resonances that were not swept.
    drifting
        Whether a rival lets the rig change with time: then the order of the steps matters, and sweeps run both ways.
    """
    found = [*_noise(runs, evidence), *_sweeps(runs, evidence, model, drifting=drifting)]
    return sorted(found, key=lambda proposal: proposal.rig_time_s)


def _noise(runs: Sequence[Run], evidence: MeasuredData) -> Iterator[Proposal]:
    """Noise over the band that was used, over each mode alone, and above each mode.

    Without the modes that move most, the others can be driven harder: the response keeps its rms, for joints answer
    to it.
    """
    if not evidence.broadband:
        yield from _first_noise(runs, evidence)
        return
    data = evidence.broadband[0]
    run = next(run for run in runs if run.path == data.run)
    device = run.device_of(evidence.force)
    force = Level.of(device.values[evidence.force])
    rms, lasted = force.std, force.count / device.sample_rate_Hz
    f, response = data.frequency_Hz, np.sum(np.abs(data.H) ** 2, axis=1) * data.force_power
    whole = (float(np.floor(f[0])), float(np.ceil(f[-1])))
    for band in _bands(evidence, whole):
        inside = (f >= band[0]) & (f <= band[1])
        if inside.sum() < LIMITS.sweeps_steps:
            continue
        felt = float(np.sqrt(data.force_power[inside].sum()))
        size = min(
            felt * float(np.sqrt(response.sum() / response[inside].sum())),
            LIMITS.most_rms * rms,
            LIMITS.sweeps_headroom * evidence.rig.force_sensor.range / LIMITS.noise_crest,
        )
        yield from _each_length(band, size, lasted, float(device.sample_rate_Hz))


def _first_noise(runs: Sequence[Run], evidence: MeasuredData) -> Iterator[Proposal]:
    """Noise over the modes that the model has, at a force below the sweeps'.

    About one resonance many causes look alike that others part.
    """
    forces = [s.target_amplitude for s in evidence.steps.states if s.target_channel == evidence.force]
    if not forces:
        return
    run = next(run for run in runs if run.path == evidence.steps.states[0].run)
    rate = float(run.device_of(evidence.force).sample_rate_Hz)
    highest = LIMITS.above_last * float(evidence.model.basis.omega[IDENTIFY.damped_modes - 1]) / (2 * np.pi)
    band = (LIMITS.noise_lowest_Hz, float(np.floor(min(highest, rate / LIMITS.noise_oversampled))))
    rms = min(
        LIMITS.noise_quiet * min(forces), LIMITS.sweeps_headroom * evidence.rig.force_sensor.range / LIMITS.noise_crest
    )
    yield from _each_length(band, rms, 60.0, rate)


def _each_length(band: tuple[float, float], rms: float, lasted: float, sample_rate: float) -> Iterator[Proposal]:
    for longer in LIMITS.noise_longer:
        duration = float(np.round(longer * lasted))
        yield Proposal(
            what=f"noise of {rms:.2g} N rms from {band[0]:.0f} to {band[1]:.0f} Hz for {duration:.0f} s",
            procedure=Random(band=band, rms=float(np.round(rms, 3)), duration=duration, sample_rate=sample_rate),
            longer=longer,
            rig_time_s=duration,
        )


def _bands(evidence: MeasuredData, whole: tuple[float, float]) -> list[tuple[float, float]]:
    natural = evidence.model.basis.omega / (2 * np.pi)
    natural = natural[(natural > whole[0]) & (natural < whole[1])]
    edges = [whole[0], *np.round(np.sqrt(natural[1:] * natural[:-1])), whole[1]]
    alone = list(pairwise(edges))
    above = [(edge, whole[1]) for edge in edges[1:-1]]
    return list(dict.fromkeys((float(a), float(b)) for a, b in [whole, *alone, *above]))


def _sweeps(runs: Sequence[Run], evidence: MeasuredData, model: FittedModel, *, drifting: bool) -> Iterator[Proposal]:
    """Sweeps over the frequencies that were used, and over other modes', at several forces and for several lengths."""
    states = [s for s in evidence.steps.states if s.target_channel == evidence.force]
    if not states:
        return
    run = next(run for run in runs if run.path == states[0].run)
    rate = float(run.device_of(evidence.force).sample_rate_Hz)
    lasted = float(np.median([s.duration_s for s in states]))
    zeta = min(evidence.rig.damping.modal_ratio)
    for band in sweep_bands(evidence, model, highest_Hz=rate / LIMITS.noise_oversampled):
        frequencies = band.frequencies_Hz
        wait = min(-np.log(LIMITS.noise_tolerance) / (zeta * 2 * np.pi * float(np.median(frequencies))), LONGEST_WAIT_s)
        about = f" about mode {band.mode}, {frequencies[0]:.4g} to {frequencies[-1]:.4g} Hz" if band.mode else ""
        for amplitude, longer in product(band.amplitudes_N, LIMITS.noise_longer):
            seconds = float(np.round(longer * lasted, 1))
            yield Proposal(
                what=f"a sweep at {amplitude:g} N{about}, {len(frequencies)} steps of {seconds:g} s"
                + (", up and down" if drifting else ""),
                procedure=SteppedSine(
                    frequencies=list(frequencies),
                    amplitudes=[amplitude],
                    direction="both" if drifting else "up",
                    sample_rate=rate,
                    measure=Measure(seconds=seconds),
                    settle=Settle(tolerance=LIMITS.noise_tolerance, maximum=LONGEST_WAIT_s),
                    limits=_limits(evidence.rig),
                ),
                longer=longer,
                rig_time_s=len(frequencies) * (wait + seconds) * (2 if drifting else 1),
            )


def _limits(rig: Rig) -> Limits:
    """Guards a little below the converters' ranges."""
    sensors = [rig.force_sensor, *rig.response_sensors]
    return Limits(peak={sensor.channel: 0.95 * sensor.range for sensor in sensors})
