"""The forward model: what the channels of a rig, with whatever a cause changes of it, answer to a drive."""

from twin.identify.forward.forward_model import ForwardModel
from twin.identify.forward.predict import RigPrediction, RigResponse
