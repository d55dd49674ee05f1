"""Structures of any parts and joints: meshes, elements, layers, assembly, modes."""

from twin.structure.assembly import assemble, with_mass_at
from twin.structure.drawn import DrawnPart, drawn_parts, drawn_places, layer_lines, point_of
from twin.structure.layer_points import layer_points, points_of_joints
from twin.structure.modes import Modes, elastic_modes, normal_modes, rigid_motions
from twin.structure.named_rows import named_rows
from twin.structure.node_field import NodeField
from twin.structure.structure import JointOperators, Structure
