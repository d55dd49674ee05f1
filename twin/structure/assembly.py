"""Assembly of a structure from its layout: beams, reduced parts, supports, ties and the joints' layers."""

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.sparse import csr_array

from twin.arrays import Array
from twin.rigs import BeamPart, Dof, Layout, Link, PointMass, Rig, Support, Tie
from twin.structure.constraints import free_coordinates
from twin.structure.elements.beam import beam_mass, beam_stiffness, rod_mass, rod_stiffness
from twin.structure.elements.space_beam import space_element
from twin.structure.joint_operators import joint_operators
from twin.structure.matrix_coordinates import AXES, MatrixCoordinates, node_pairs, reduced_parts
from twin.structure.mesh import PLANE_DOFS, SPACE_DOFS, BeamMesh, mesh_beams, mesh_layers
from twin.structure.sparse import from_blocks, with_square
from twin.structure.structure import Structure

Mesh = BeamMesh | MatrixCoordinates


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
    for mass in layout.masses:
        for inertia, row in _moved(mass, meshes[mass.part], size):
            M = with_square(M, inertia, row)
    for spring in layout.springs:
        for rate, row in _against(spring, spring.stiffness, meshes, size):
            K0 = with_square(K0, rate, row)
    dampers = [np.zeros((0, size))]
    for damper in layout.dampers:
        dampers += [np.sqrt(rate) * row[None] for rate, row in _against(damper, damper.damping, meshes, size)]
    constraints = [np.zeros((0, size))]
    for support in layout.supports:
        constraints.append(_fixed(support, meshes[support.part], size))
        for rate, row in _held(support, meshes[support.part], size):
            K0 = with_square(K0, rate, row)
    constraints += [_tied(tie, layout, meshes, size) for tie in layout.ties]
    basis, free = free_coordinates(np.vstack(constraints))
    joints = tuple(joint.over(basis) for joint in joint_operators(layout, layers, meshes, size))
    B_C = np.vstack(dampers) @ basis
    M, K0 = (csr_array(basis.T @ A @ basis) for A in (M, K0))
    structure = Structure(M, K0, B_C, joints, layout, meshes, basis, free)
    if sensor_masses:
        for sensor in rig.sensors:
            structure = structure.with_mass_at(rig.place_of(sensor.channel), sensor.mass)
    if rig.shaker.stinger_lateral_stiffness:
        structure = structure.with_lateral_spring(rig.drive_place, rig.shaker.stinger_lateral_stiffness)
    return structure


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


def _dof(mesh: Mesh, at: float, name: str) -> tuple[Array, Array] | None:
    """Displacements and coefficients of one motion at a node; None where it has none."""
    if isinstance(mesh, MatrixCoordinates):
        return mesh.dof(at, name)
    if name not in mesh.dofs:
        return None
    return mesh.node_dofs(at)[[mesh.dofs.index(name)]], np.ones(1)


def _row(mesh: Mesh, at: float, name: str, size: int) -> Array | None:
    found = _dof(mesh, at, name)
    if found is None:
        return None
    row = np.zeros(size)
    row[found[0]] = found[1]
    return row


def _fixed(support: Support, mesh: Mesh, size: int) -> Array:
    rows = [row for name in support.fix if (row := _row(mesh, support.at, name, size)) is not None]
    return np.array(rows).reshape(-1, size)


def _held(support: Support, mesh: Mesh, size: int) -> Iterator[tuple[float, Array]]:
    """Each spring of a support, with the row of the motion that it holds."""
    for name, stiffness in support.stiffness.items():
        row = _row(mesh, support.at, name, size)
        if row is not None:
            yield stiffness, row


def _moved(mass: PointMass, mesh: Mesh, size: int) -> Iterator[tuple[float, Array]]:
    """Each inertia of a point mass, with the row of the motion that it resists."""
    for name, inertia in (*((axis, mass.mass) for axis in AXES), *mass.inertia.items()):
        row = _row(mesh, mass.at, name, size)
        if row is not None:
            yield inertia, row


def _against(
    link: Link, rates: Mapping[Dof, float], meshes: Mapping[str, Mesh], size: int
) -> Iterator[tuple[float, Array]]:
    """Each rate of a link, with the row of the motion of its ends against each other."""
    first, second = (meshes[name] for name in link.between)
    for name, rate in rates.items():
        one, two = _row(first, link.at[0], name, size), _row(second, link.at[1], name, size)
        if one is not None and two is not None:
            yield rate, two - one


def _tied(tie: Tie, layout: Layout, meshes: dict[str, Mesh], size: int) -> Array:
    """Constraints (c, N): the second part moves with the first as if a rigid arm joined both places."""
    first, second = (meshes[name] for name in tie.between)
    rows = []
    if tie.at is not None:
        a, b = tie.at
        dx, dy, dz = second.coordinates(b) - first.coordinates(a)
        arms = {"x": {"ry": dz, "rz": -dy}, "y": {"rz": dx, "rx": -dz}, "z": {"rx": dy, "ry": -dx}}
        in_space = any(isinstance(mesh, BeamMesh) and mesh.part.in_space for mesh in (first, second))
        dofs = SPACE_DOFS if in_space else PLANE_DOFS
        for name in dofs:
            one, two = _row(first, a, name, size), _row(second, b, name, size)
            if one is None or two is None:
                continue
            for turn, arm in arms.get(name, {}).items():
                turned = _row(first, a, turn, size) if turn in dofs and arm else None
                one = one if turned is None else one + arm * turned
            rows.append(two - one)
    elif isinstance(first, MatrixCoordinates) and isinstance(second, MatrixCoordinates) and tie.pairs:
        pairs = node_pairs(layout, tie.pairs, where="tie", parts=[first.matrices, second.matrices])
        for a, b in zip(pairs.a, pairs.b, strict=True):
            for name in AXES:
                one, two = _row(first, a, name, size), _row(second, b, name, size)
                if one is not None and two is not None:
                    rows.append(two - one)
    return np.array(rows).reshape(-1, size)
