"""Measured parts beside modelled ones: receptances synthesised, expanded, coupled; joints identified."""

from twin.substructuring.joint_identification import CoupledPrediction, JointFit, JointValues, identify_joints, predict
from twin.substructuring.substructures import Substructures, gather_substructures
