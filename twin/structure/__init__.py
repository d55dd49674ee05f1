"""Structures of any parts and joints: meshes, elements, layers, assembly, modes."""

from twin.structure.assembly import assemble
from twin.structure.drawn import BeamLine, DrawnPart, beam_lines, drawn_parts, drawn_position, point_of
from twin.structure.layer_points import LayerPoints, layer_points, points_of_joints
from twin.structure.modes import Modes, normal_modes, rigid_motions
from twin.structure.node_field import NodeField
from twin.structure.structure import JointOperators, Structure

__all__ = [
    "BeamLine",
    "DrawnPart",
    "JointOperators",
    "LayerPoints",
    "Modes",
    "NodeField",
    "Structure",
    "assemble",
    "beam_lines",
    "drawn_parts",
    "drawn_position",
    "layer_points",
    "normal_modes",
    "point_of",
    "points_of_joints",
    "rigid_motions",
]
