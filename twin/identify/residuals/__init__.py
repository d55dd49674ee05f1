"""Residuals of all data against a model, the covariance of their errors, and so the likelihood."""

from twin.identify.residuals.error_model import ErrorModel
from twin.identify.residuals.frequency_model import FrequencyModel
from twin.identify.residuals.residual_model import ResidualModel
