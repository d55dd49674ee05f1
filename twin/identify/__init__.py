"""Identification: recordings reduced to numbers, and the model that explains them."""

from twin.identify.base_fit import fit_base
from twin.identify.evidence import Evidence, gather_evidence
from twin.identify.joint_law import LayerLaw
from twin.identify.prediction import Predictor
from twin.identify.sine_fit import SteadyState, steady_states
from twin.identify.unknowns import Unknowns

__all__ = [
    "Evidence",
    "LayerLaw",
    "Predictor",
    "SteadyState",
    "Unknowns",
    "fit_base",
    "gather_evidence",
    "steady_states",
]
