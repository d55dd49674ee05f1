"""Finite elements of the lap joint: beams, thin layer, mesh, assembly, modes."""

from twin.structure.assembly import Structure, assemble
from twin.structure.layer_points import LayerPoints, layer_points
from twin.structure.mesh import LapJointMesh, mesh_rig
from twin.structure.modes import Modes, eigenvalue_sensitivity, normal_modes

__all__ = [
    "LapJointMesh",
    "LayerPoints",
    "Modes",
    "Structure",
    "assemble",
    "eigenvalue_sensitivity",
    "layer_points",
    "mesh_rig",
    "normal_modes",
]
