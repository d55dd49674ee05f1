"""A short section of a beam that is weaker than the rest, wherever the mesh has its nodes."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.arrays import Array
from twin.rigs import BeamPart, Place, Rig
from twin.structure.elements.beam import beam_stiffness, rod_stiffness, weakened_stiffness
from twin.structure.elements.space_beam import space_element
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure


@dataclass(frozen=True, eq=False)
class WeakenedSection:
    """What a weak section takes off the stiffness: `lost` (k,), N/m, on motions `forms` of all displacements (k, N)."""

    forms: Array
    lost: Array

    def rows(self, structure: Structure) -> Array:
        """The motions over a structure's coordinates, (k, n)."""
        return np.asarray(self.forms @ structure.sparse_basis)


def weakened_section(rig: Rig, structure: Structure, *, place: Place, factor: float) -> WeakenedSection:
    """Multiply a beam's stiffness by `factor` over a section centred at a place on a beam.

    The section is as long as an average element of the rig file's mesh, whatever the structure's own is.
    """
    beams = rig.layout().beams
    half = sum(beam.length for beam in beams) / sum(beam.elements for beam in beams) / 2
    mesh = structure.meshes[place.part]
    assert isinstance(mesh, BeamMesh)
    beam, first = mesh.part, mesh.element_dofs
    forms, lost = [], []
    for e, (a, b) in enumerate(pairwise(mesh.s)):
        weak = max(a, place.at - half) - a, min(b, place.at + half) - a
        if weak[0] < weak[1]:
            size, shape = np.linalg.eigh(_change(beam, float(b - a), weak, factor))
            for k in range(len(shape) // 2):
                form = np.zeros(structure.sparse_basis.shape[0])
                form[first[e]] = shape[:, k] @ mesh.rotation
                forms.append(form)
                lost.append(size[k])
    return WeakenedSection(np.array(forms), np.array(lost))


def _change(beam: BeamPart, length: float, weak: tuple[float, float], factor: float) -> Array:
    """What an element's stiffness changes by, (6, 6) or (12, 12); half of its motions strain it."""
    section = {"EA": beam.youngs_modulus * beam.area, "length": length, "shear_ratio": beam.shear_ratio}

    def bent(second_moment: float) -> Array:
        own = {**section, "EI": beam.youngs_modulus * second_moment}
        return weakened_stiffness(**own, weak=weak, factor=factor) - beam_stiffness(**own)

    if not beam.in_space:
        return bent(beam.second_moment)
    softer = length / (length + (1 / factor - 1) * (weak[1] - weak[0])) - 1
    twist = softer * rod_stiffness(beam.torsional_stiffness, length)
    return space_element(bent(beam.second_moment), bent(beam.second_moment_across), twist)
