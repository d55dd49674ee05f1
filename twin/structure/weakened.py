"""A short section of a beam that is weaker than the rest, wherever the mesh has its nodes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from twin.rigs import Rig
from twin.structure.beam import Matrix, beam_stiffness, weakened_stiffness
from twin.structure.mesh import LapJointMesh

__all__ = ["weakened_elements"]


def weakened_elements(
    rig: Rig, mesh: LapJointMesh, *, position_m: float, factor: float
) -> Iterator[tuple[int, Matrix]]:
    """Number of the first degree of freedom, and change of the stiffness (6, 6), of each element that is weaker.

    The section is centred at `position_m` and as long as an average element of the rig file's mesh, whatever `mesh` is;
    within the overlap it lies in the lower beam.
    """
    half = (rig.lower.length + rig.upper.length) / rig.mesh.beam_elements / 2
    lower = position_m <= rig.lower.length
    beam, nodes, first = (rig.lower, mesh.lower_x, 0) if lower else (rig.upper, mesh.upper_x, len(mesh.lower_x))
    section = {"EA": beam.youngs_modulus * beam.area, "EI": beam.youngs_modulus * beam.second_moment}
    for e, (a, b) in enumerate(pairwise(nodes)):
        weak = max(a, position_m - half) - a, min(b, position_m + half) - a
        if weak[0] < weak[1]:
            element = {**section, "length": float(b - a), "shear_ratio": beam.shear_ratio}
            yield 3 * (first + e), weakened_stiffness(**element, weak=weak, factor=factor) - beam_stiffness(**element)
