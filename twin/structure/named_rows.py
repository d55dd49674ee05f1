"""Whose the rows of a structure's matrices are, for programs that know of nodes and degrees of freedom."""

from collections.abc import Iterator

from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure


def named_rows(structure: Structure) -> Iterator[tuple[int, str, int, float, float, float]]:
    """Node, degree of freedom, row and place of every row; nodes counted from 1 through all beams.

    Raises
    ------
    ValueError
        If a part is given by matrices, whose rows may belong to no node.
    """
    whose: dict[int, tuple[int, str, float, float, float]] = {}
    node = 0
    for name, mesh in structure.meshes.items():
        if not isinstance(mesh, BeamMesh):
            raise ValueError(f"part {name} is given by matrices")
        for number, (x, y, z) in enumerate(mesh.points):
            node += 1
            for dof, motion in enumerate(mesh.dofs):
                whose[mesh.first + len(mesh.dofs) * number + dof] = (node, motion, float(x), float(y), float(z))
    for row, displacement in enumerate(structure.free):
        node, motion, x, y, z = whose[int(displacement)]
        yield node, motion, row, x, y, z
