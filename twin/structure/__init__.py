"""Finite elements of the lap joint: beams, thin layer, mesh, assembly, modes."""

from twin.structure.assembly import Structure, assemble
from twin.structure.mesh import LapJointMesh, mesh_rig
from twin.structure.modes import Modes, eigenvalue_sensitivity, normal_modes

__all__ = [
    "LapJointMesh",
    "Modes",
    "Structure",
    "assemble",
    "eigenvalue_sensitivity",
    "mesh_rig",
    "normal_modes",
]
