"""A first broadband run where there are only sweeps: about one resonance many causes look alike that others part.

What it would bring is imagined from the sweeps' own noise, and from the model's responses in bins as narrow near its
resonances as a real run's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from recordings.run import Run
from twin.diagnose.candidate import Candidate, extension_of
from twin.diagnose.next_test.proposal import CREST, HEADROOM, LONGER, Proposal
from twin.identify.broadband import BinnedResponse, response_bins
from twin.identify.evidence import Evidence
from twin.identify.prediction import Predictor
from twin.procedures import Random

__all__ = ["first_noise", "imagined_bins"]

LOWEST_Hz, ABOVE_LAST, OVERSAMPLED = 5.0, 1.2, 4.0
"""The band's lower edge; the upper one over the last mode whose damping is identified; samples a period of it."""
QUIET = 1 / 3
"""Rms force over the smallest sine's amplitude: the joint is to act as in the smallest sweep or less."""
DURATION_s = 60.0


def first_noise(runs: Sequence[Run], evidence: Evidence) -> Iterator[Proposal]:
    """Noise over the modes that the model has, at a force below the sweeps'; none if a broadband run is there."""
    forces = [s.target_amplitude for s in evidence.steps.states if s.target_channel == evidence.force]
    if evidence.broadband or not forces:
        return
    run = next(run for run in runs if run.path == evidence.steps.states[0].run)
    rate = float(run.device_of(evidence.force).sample_rate_Hz)
    modes = len(evidence.model.ports.rows[evidence.model.ports.modal])
    highest = ABOVE_LAST * float(evidence.model.basis.omega[modes - 1]) / (2 * np.pi)
    band = (LOWEST_Hz, float(np.floor(min(highest, rate / OVERSAMPLED))))
    rms = float(np.round(min(QUIET * min(forces), HEADROOM * evidence.rig.force_sensor.range / CREST), 3))
    for longer in LONGER:
        duration = DURATION_s * longer
        yield Proposal(
            what=f"noise of {rms:.2g} N rms from {band[0]:.0f} to {band[1]:.0f} Hz for {duration:.0f} s",
            procedure=Random(band=band, rms=rms, duration=duration, sample_rate=rate),
            longer=longer,
            rig_time_s=duration,
        )


def imagined_bins(evidence: Evidence, truth: Candidate, procedure: Random, time_s: float) -> BinnedResponse:
    """The run in bins if a model were true: its responses, with the noise that the sweeps' steps showed."""
    steps, duration = evidence.steps, procedure.duration
    frequency = np.arange(procedure.band[0], procedure.band[1], 1 / duration)
    edges = response_bins(frequency, evidence.model.basis.omega / (2 * np.pi))
    counts = np.diff(edges)
    # A line of the run and a sine's fit see the same noise, for as long as each lasts.
    shorter = float(np.median([state.duration_s for state in steps.states])) / duration
    force_noise = shorter * float(np.median(steps.force_variance[:, 0]))
    response_noise = shorter * np.median(steps.response_variance[:, :, 0], axis=0)
    of_each_line = 2 * procedure.rms**2 / len(frequency)
    bins, outputs = len(counts), len(evidence.channels)
    data = BinnedResponse(
        run=evidence.runs[0].path,
        time_s=time_s,
        frequency_Hz=np.add.reduceat(frequency, edges[:-1]) / counts,
        H=np.ones((bins, outputs), complex),
        relative_covariance=np.broadcast_to(np.eye(outputs, dtype=complex), (bins, outputs, outputs)),
        channels=evidence.channels,
        noise_density={},
        distortion=np.ones(bins),
        force_power=counts * of_each_line / 2,
    )
    predictor = Predictor(evidence, extension_of(evidence, truth.blames))
    H = predictor.responses(*predictor.broadband_receptance(data, truth.unknowns, data.omega))
    covariance = force_noise + np.eye(outputs) * (response_noise / np.abs(H) ** 2)[:, :, None]
    relative = (covariance / (counts * of_each_line)[:, None, None]).astype(complex)
    return replace(data, H=H, relative_covariance=relative)
