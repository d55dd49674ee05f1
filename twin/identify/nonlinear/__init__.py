"""Nonlinear forces, the law of the joints first of all: at ports, by their own motion, balanced in harmonics."""

from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.local_forces import LocalForces
from twin.identify.nonlinear.opening_harmonics import Openings
