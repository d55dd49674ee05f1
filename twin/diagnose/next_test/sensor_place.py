"""Where one more accelerometer would tell the rivals apart: the same broadband run again, with a channel more.

Each candidate place gets the noise that the response channels showed; the sensor's own mass is not on the structure.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.next_test.limits import LIMITS
from twin.diagnose.next_test.predicted_data import PredictedData
from twin.diagnose.next_test.separation import Promise, least_promise
from twin.identify.linear.linear_model import Output
from twin.identify.measured_data import MeasuredData, drive_places
from twin.identify.spectra.broadband import BinnedResponse
from twin.rigs import BeamPart, Place

NEW = "new sensor"
"""Name of the channel that is predicted."""


def best_sensor_place(
    evidence: MeasuredData, best: FittedModel, rivals: Sequence[FittedModel], *, margin: float
) -> tuple[Place, Promise] | None:
    """The place that parts the best model from its rivals farthest, and what it promises; None without noise.

    Parameters
    ----------
    margin
        Gain of log evidence by which a rival counts as beaten.
    """
    if not evidence.broadband or not rivals:
        return None
    found = []
    for place in _candidate_places(evidence):
        data = [_predict_test_data(evidence, truth, place) for truth in (best, *rivals)]
        found.append((place, least_promise(best, rivals, data, margin=margin)))
    return max(found, key=lambda one: one[1].share, default=None)


def _candidate_places(evidence: MeasuredData) -> list[Place]:
    """Places across the beams and the parts given by matrices, without those that have a sensor already."""
    layout, structure = evidence.rig.layout(), evidence.model.structure
    whole, found = sum(beam.length for beam in layout.beams), []
    for part in layout.parts:
        if isinstance(part, BeamPart):
            count = max(round(LIMITS.on_beams * part.length / whole), 2)
            found += [Place(part.name, part.length * (k + 1) / count, part.normal) for k in range(count)]
        else:
            field = structure.node_field(part.name)
            nodes = field.nodes[_spread(field.coordinates, LIMITS.on_part)]
            found += [Place(part.name, float(node), direction) for node in nodes for direction in field.across]
    taken = [structure.row(output.place) for output in evidence.outputs]
    return [place for place in found if not any(_alike(structure.row(place), row) for row in taken)]


def _alike(one: Array, two: Array) -> bool:
    """Whether two rows read the same but for sign."""
    size = np.linalg.norm(one) * np.linalg.norm(two)
    return bool(size == 0 or abs(one @ two) > 0.999 * size)


def _spread(points: Array, count: int) -> list[int]:
    """Numbers of points far from each other, each the farthest from those before."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def _predict_test_data(evidence: MeasuredData, truth: FittedModel, place: Place) -> PredictedData:
    """The last broadband run if a model were true, with an accelerometer more."""
    data = evidence.broadband[-1]
    outputs = (*evidence.outputs, Output(NEW, "acceleration", place))
    model = evidence.model.with_places(outputs, [drive_places(evidence)[0], *[*evidence.rig.drives.values()][1:]])
    more = replace(evidence.without_steps(), outputs=outputs, model=model, broadband=())
    residual_model = truth.residual_model(more)
    R, omega = residual_model.broadband_receptance(data, truth.baseline, data.omega)
    bins = _with_channel(evidence, data, residual_model.responses(R, omega))
    return PredictedData.beside(replace(more, broadband=(bins,)), None, truth)


def _with_channel(evidence: MeasuredData, data: BinnedResponse, H: Array) -> BinnedResponse:
    """The bins with responses H (b, o + 1), the last channel as noisy as the quietest accelerometer."""
    bins, outputs = data.H.shape
    accelerometers = [i for i, output in enumerate(evidence.outputs) if output.quantity == "acceleration"]
    own = data.variance * np.abs(data.H) ** 2
    absolute = np.min(own[:, accelerometers or range(outputs)], axis=1)
    covariance = np.zeros((bins, outputs + 1, outputs + 1), complex)
    covariance[:, :outputs, :outputs] = data.relative_covariance
    covariance[:, outputs, outputs] = absolute / np.abs(H[:, outputs]) ** 2
    return replace(data, H=H, relative_covariance=covariance, channels=(*data.channels, NEW))
