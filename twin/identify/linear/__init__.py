"""The linear rig: receptances between its ports, and its moduli and damping fitted to broadband runs."""

from twin.identify.linear.linear_fit import base_prior
from twin.identify.linear.linear_model import (
    LinearModel,
    LinearParameters,
    Output,
    build_linear_model,
    nominal_parameters,
)
from twin.identify.linear.structural_modification import update_receptance
