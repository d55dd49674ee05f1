"""Identification: recordings reduced to numbers, and the model that explains them."""

from twin.identify.measured_data import MeasuredData, gather_data
from twin.identify.spectra.sine_fit import SteadyState, steady_states

__all__ = ["MeasuredData", "SteadyState", "gather_data", "steady_states"]
