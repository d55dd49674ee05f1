"""Structures of any parts and joints: meshes, elements, layers, assembly, modes."""

from twin.structure.assembly import assemble
from twin.structure.drawn import BeamLine, beam_lines, drawn_position
from twin.structure.layer_points import LayerPoints, layer_points
from twin.structure.modes import Modes, eigenvalue_sensitivity, normal_modes
from twin.structure.structure import JointOperators, Structure

__all__ = [
    "BeamLine",
    "JointOperators",
    "LayerPoints",
    "Modes",
    "Structure",
    "assemble",
    "beam_lines",
    "drawn_position",
    "eigenvalue_sensitivity",
    "layer_points",
    "normal_modes",
]
