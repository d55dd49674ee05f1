"""Identification: recordings reduced to numbers, and the model that explains them."""

from twin.identify.base_fit import fit_base
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData, gather_data
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.spectra.sine_fit import SteadyState, steady_states
