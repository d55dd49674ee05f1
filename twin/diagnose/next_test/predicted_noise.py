"""What a first broadband run would bring where there are only sweeps.

It is predicted from the sweeps' own noise, and from the model's responses in bins as narrow near its resonances as a
real run's.
"""

from dataclasses import replace

import numpy as np

from twin.diagnose.fitted_model import FittedModel
from twin.identify.measured_data import MeasuredData
from twin.identify.spectra.broadband import BinnedResponse, response_bins
from twin.procedures import Random


def predicted_bins(evidence: MeasuredData, truth: FittedModel, procedure: Random, time_s: float) -> BinnedResponse:
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
    residual_model = truth.residual_model(evidence)
    H = residual_model.responses(*residual_model.broadband_receptance(data, truth.baseline, data.omega))
    covariance = force_noise + np.eye(outputs) * (response_noise / np.abs(H) ** 2)[:, :, None]
    relative = (covariance / (counts * of_each_line)[:, None, None]).astype(complex)
    return replace(data, H=H, relative_covariance=relative)
