"""Assembly of a structure from its layout: beams, reduced parts, supports, ties and the joints' layers."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from recordings.directions import AXES
from twin.arrays import Array
from twin.rigs import BeamPart, Layout, Place, Rig, Tie
from twin.rigs.layout import DOFS
from twin.structure.constraints import free_coordinates
from twin.structure.elements.beam import beam_mass, beam_stiffness, rod_mass, rod_stiffness
from twin.structure.elements.space_beam import space_element
from twin.structure.joint_operators import joint_operators
from twin.structure.matrix_coordinates import MatrixCoordinates, node_pairs, reduced_parts
from twin.structure.mesh import PLANE_DOFS, BeamMesh, mesh_beams, mesh_layers
from twin.structure.sparse import from_blocks, with_square
from twin.structure.structure import Mesh, Structure


def assemble(rig: Rig, *, layout: Layout | None = None, sensor_masses: bool = True) -> Structure:
    """Assemble the structure of `rig`.

    Parameters
    ----------
    layout
        Other than the rig file's own: a finer mesh, another beam, other supports.
    sensor_masses
        Whether the sensors' masses are in M.

    Raises
    ------
    InputError
        If a file of a part given by matrices cannot be read or does not fit.
    """
    layout = layout or rig.layout()
    layers = mesh_layers(layout)
    beams = mesh_beams(layout, layers)
    reduced = reduced_parts(layout, rig, first=sum(beam.size for beam in beams))
    meshes: dict[str, Mesh] = {beam.part.name: beam for beam in beams}
    meshes |= {part.part.name: part for part in reduced}
    size = sum(mesh.size for mesh in meshes.values())
    M, K0 = csr_array((size, size)), csr_array((size, size))
    for beam in beams:
        stiffness, mass_of = beam_elements(beam)
        M, K0 = M + chain(beam, mass_of, size), K0 + chain(beam, stiffness, size)
    for part in reduced:
        own = np.arange(part.first, part.first + part.size)[None]
        M = M + from_blocks(own, own, part.reduced.M[None], size)
        K0 = K0 + from_blocks(own, own, part.reduced.K[None], size)
    motions = _Motions(meshes, size)
    for mass in layout.masses:
        for inertia, row in motions.at(
            mass.part, mass.at, (*((axis, mass.mass) for axis in AXES), *mass.inertia.items())
        ):
            M = with_square(M, inertia, row)
    for spring in layout.springs:
        for rate, row in motions.between(spring.between, spring.at, spring.stiffness.items()):
            K0 = with_square(K0, rate, row)
    dampers = [np.zeros((0, size))]
    for damper in layout.dampers:
        ends = motions.between(damper.between, damper.at, damper.damping.items())
        dampers += [np.sqrt(rate) * row[None] for rate, row in ends]
    constraints = [np.zeros((0, size))]
    for support in layout.supports:
        fixed = motions.at(support.part, support.at, ((dof, 1.0) for dof in support.fix))
        constraints += [row[None] for _, row in fixed]
        for rate, row in motions.at(support.part, support.at, support.stiffness.items()):
            K0 = with_square(K0, rate, row)
    constraints += [row[None] for tie in layout.ties for row in _tied(tie, layout, motions)]
    basis, free = free_coordinates(np.vstack(constraints))
    joints = tuple(joint.over(basis) for joint in joint_operators(layout, layers, meshes, size))
    B_C = np.vstack(dampers) @ basis
    M, K0 = (csr_array(basis.T @ A @ basis) for A in (M, K0))
    structure = Structure(M, K0, B_C, joints, layout, meshes, basis, free)
    if sensor_masses:
        for sensor in rig.sensor:
            structure = with_mass_at(structure, rig.place_of(sensor.channel), sensor.mass)
    if rig.shaker.stinger_lateral_stiffness:
        # Along a beam, at its right surface: the stinger resists slope too.
        row = structure.surface_motion(rig.drive_place, side=-1)
        K0 = with_square(structure.sparse_K0, rig.shaker.stinger_lateral_stiffness, row)
        structure = replace(structure, sparse_K0=K0)
    return structure


def with_mass_at(structure: Structure, place: Place, mass_kg: float) -> Structure:
    """The same structure with a mass fixed at a place."""
    M = structure.sparse_M
    for row in structure.translations(place)[::-1]:
        M = with_square(M, mass_kg, row)
    return replace(structure, sparse_M=M)


def beam_elements(mesh: BeamMesh) -> tuple[Array, Array]:
    """Stiffness and mass (e, 6, 6) or (e, 12, 12) of a beam's elements, Euler-Bernoulli or Timoshenko."""
    beam, length = mesh.part, np.diff(mesh.s)
    stiffness, mass = _plane_elements(beam, length, beam.second_moment)
    if beam.in_space:
        stiff_across, heavy_across = _plane_elements(beam, length, beam.second_moment_across)
        polar = beam.second_moment + beam.second_moment_across
        stiffness = space_element(stiffness, stiff_across, rod_stiffness(beam.torsional_stiffness, length))
        mass = space_element(mass, heavy_across, rod_mass(beam.density * polar, length))
    return stiffness, mass


def _plane_elements(beam: BeamPart, length: Array, second_moment: float) -> tuple[Array, Array]:
    """Stiffness and mass (e, 6, 6) of elements that bend in one plane."""
    EA, EI = beam.youngs_modulus * beam.area, beam.youngs_modulus * second_moment
    stiffness = beam_stiffness(EA=EA, EI=EI, length=length, shear_ratio=beam.shear_ratio)
    radius2 = second_moment / beam.area if beam.shear_ratio > 0 else 0.0
    mass = beam_mass(
        mass_per_length=beam.density * beam.area, length=length, radius2=radius2, shear_ratio=beam.shear_ratio
    )
    return stiffness, mass


def chain(mesh: BeamMesh, elements: Array, size: int) -> csr_array:
    """A beam's matrix over `size` displacements, of its elements (e, 6, 6) or (e, 12, 12) over their own."""
    turn = mesh.rotation
    return from_blocks(mesh.element_dofs, mesh.element_dofs, turn.T @ elements @ turn, size)


@dataclass(frozen=True, eq=False)
class _Motions:
    """Rows over all displacements, of the motions that places on parts have."""

    meshes: Mapping[str, Mesh]
    size: int

    def row(self, part: str, at: float, name: str) -> Array | None:
        """Of one motion; None where the place has none."""
        found = self.meshes[part].dof(at, name)
        if found is None:
            return None
        row = np.zeros(self.size)
        row[found[0]] = found[1]
        return row

    def at(self, part: str, at: float, values: Iterable[tuple[str, float]]) -> Iterator[tuple[float, Array]]:
        """What goes with a place's motions, each with its row."""
        for name, value in values:
            row = self.row(part, at, name)
            if row is not None:
                yield value, row

    def between(
        self, parts: tuple[str, str], at: tuple[float, float], values: Iterable[tuple[str, float]]
    ) -> Iterator[tuple[float, Array]]:
        """The same of the motions of two places against each other, where both have them."""
        for name, value in values:
            one, two = (self.row(part, place, name) for part, place in zip(parts, at, strict=True))
            if one is not None and two is not None:
                yield value, two - one


def _tied(tie: Tie, layout: Layout, motions: _Motions) -> Iterator[Array]:
    """Constraints (N,): the second part moves with the first as if a rigid arm joined both places."""
    first, second = (motions.meshes[name] for name in tie.between)
    if tie.at is not None:
        dx, dy, dz = second.coordinates(tie.at[1]) - first.coordinates(tie.at[0])
        arms = {"x": {"ry": dz, "rz": -dy}, "y": {"rz": dx, "rx": -dz}, "z": {"rx": dy, "ry": -dx}}
        in_space = any(isinstance(mesh, BeamMesh) and mesh.part.in_space for mesh in (first, second))
        dofs = DOFS if in_space else PLANE_DOFS
        for name in dofs:
            for _, row in motions.between(tie.between, tie.at, [(name, 1.0)]):
                for turn, arm in arms.get(name, {}).items():
                    turned = motions.row(tie.between[0], tie.at[0], turn) if turn in dofs and arm else None
                    row = row if turned is None else row - arm * turned
                yield row
    elif isinstance(first, MatrixCoordinates) and isinstance(second, MatrixCoordinates) and tie.pairs:
        pairs = node_pairs(layout, tie.pairs, where="tie", parts=[first.matrices, second.matrices])
        for nodes in zip(pairs.a, pairs.b, strict=True):
            yield from (row for _, row in motions.between(tie.between, nodes, ((axis, 1.0) for axis in AXES)))
