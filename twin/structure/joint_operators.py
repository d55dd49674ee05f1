"""Strain operators of the joints' layers: between beams by their own kinematics, between node pairs by differences."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from twin.arrays import Array
from twin.rigs import Layout, ThinLayer
from twin.structure.elements.thin_layer import ThinLayerElement, space_thin_layer, thin_layer
from twin.structure.limits import LIMITS
from twin.structure.matrix_coordinates import MatrixCoordinates, node_pairs
from twin.structure.mesh import BeamMesh, LayerMesh
from twin.structure.structure import JointOperators

Mesh = BeamMesh | MatrixCoordinates


def joint_operators(
    layout: Layout, layers: Sequence[LayerMesh], meshes: Mapping[str, Mesh], size: int
) -> Iterator[JointOperators]:
    """Operators of all joints over `size` displacements, in the layout's order."""
    between_beams = {layer.joint.name: layer for layer in layers}
    for joint in layout.joints:
        first, second = (meshes[name] for name in joint.between)
        if isinstance(first, BeamMesh) and isinstance(second, BeamMesh):
            yield of_beams(between_beams[joint.name], first, second, size)
        elif isinstance(first, MatrixCoordinates) and isinstance(second, MatrixCoordinates):
            yield _of_pairs(layout, joint, first, second, size)


def layer_element_dofs(
    layer: LayerMesh, first: BeamMesh, second: BeamMesh
) -> Iterator[tuple[float, float, Array, Array]]:
    """Begin (m along the first beam) and length of each element of a layer, and its displacements.

    These are twelve of plane beams, 24 of beams in space, those of the beam below first; with them goes the rotation
    from x, y and z to the first beam's axis, normal and across both.
    """
    turn = np.asarray(np.kron(np.eye(2), first.rotation), float)
    below = first if _second_is_above(first, second) else second
    for n in range(len(layer.first) - 1):
        ends = {first: layer.first[n : n + 2], second: layer.second[n : n + 2]}
        above = second if below is first else first
        dofs = [mesh.node_dofs(s) for mesh in (below, above) for s in ends[mesh]]
        yield float(layer.first[n]), float(layer.first[n + 1] - layer.first[n]), np.concatenate(dofs), turn


def _second_is_above(first: BeamMesh, second: BeamMesh) -> bool:
    """On the left of the first, where its normal points; also where both axes are drawn as one line."""
    offset = second.part.origin - first.part.origin
    return float(offset @ np.array(first.part.normal)) > -1e-9


def of_beams(
    layer: LayerMesh,
    first: BeamMesh,
    second: BeamMesh,
    size: int,
    *,
    make: Callable[..., ThinLayerElement] | None = None,
) -> JointOperators:
    """Operators of a layer between two beams over `size` displacements.

    Parameters
    ----------
    make
        Makes an element of a length, a height and a width; the beams' own thin layer if left out.
    """
    joint = layer.joint
    bottom, top = (first, second) if _second_is_above(first, second) else (second, first)
    if make is None:
        layer_of = space_thin_layer if first.part.in_space else thin_layer
        make = partial(layer_of, bottom_thickness=bottom.part.thickness, top_thickness=top.part.thickness)
    width = joint.width or min(first.part.width, second.part.width)
    names = ("B_E", "B_G", "normal_weight", "shear_weight", "normal_at", "shear_at", "shear_direction")
    found: dict[str, list[Array]] = {name: [] for name in names}
    for begin, length, dofs, turn in layer_element_dofs(layer, first, second):
        element = make(length=length, height=joint.layer_height, width=width)
        for name, B in (("B_E", element.B_E), ("B_G", element.B_G)):
            full = np.zeros((len(B), size))
            full[:, dofs] = B @ turn
            found[name].append(full)
        found["normal_weight"].append(element.normal_weight)
        found["shear_weight"].append(element.shear_weight)
        found["normal_at"].append(begin + length * element.normal_at)
        found["shear_at"].append(begin + length * element.shear_at)
        along = np.zeros(len(element.B_G), np.int64)
        found["shear_direction"].append(along if element.shear_direction is None else element.shear_direction)
    whole = {name: np.concatenate(parts) for name, parts in found.items()}
    return JointOperators(
        name=joint.name,
        ends=(float(layer.first[0]), float(layer.first[-1])),
        points=first.coordinates(whole["normal_at"]),
        **whole,
    )


def _of_pairs(
    layout: Layout, joint: ThinLayer, first: MatrixCoordinates, second: MatrixCoordinates, size: int
) -> JointOperators:
    assert joint.pairs is not None
    pairs = node_pairs(layout, joint.pairs, where=joint.name, parts=[first.matrices, second.matrices])
    weight = np.sqrt(pairs.area_m2 / joint.layer_height)
    points = np.array([first.coordinates(node) for node in pairs.a])
    along = points - points.mean(axis=0)
    # The longest axis of the contact, in a fixed sense.
    axis = np.linalg.svd(along, full_matrices=False)[2][0]
    axis = axis * (np.sign(axis[np.argmax(np.abs(axis))]) or 1.0)
    at = along @ axis
    rows = []
    for factor, a, b, out in zip(weight, pairs.a, pairs.b, pairs.normal, strict=True):
        ways = (out, *_tangents(out, axis))
        rows += [factor * _difference(first, second, int(a), int(b), way, size) for way in ways]
    B = np.array(rows).reshape(len(weight), 3, size)
    B_G, order = B[:, 1:].reshape(-1, size), np.repeat(np.arange(len(weight)), 2)
    moves = np.max(np.abs(B_G), axis=1) > LIMITS.joint_operators_nothing * np.max(np.abs(B_G), initial=1.0)
    kept = moves if moves.any() else np.ones(len(B_G), bool)
    reach = float(np.ptp(at)) or 1.0
    return JointOperators(
        name=joint.name,
        B_E=B[:, 0],
        B_G=B_G[kept],
        normal_weight=weight,
        shear_weight=weight[order[kept]],
        normal_at=at,
        shear_at=at[order[kept]],
        shear_direction=np.tile([0, 1], len(weight))[kept],
        ends=(float(at.min()) - 1e-6 * reach, float(at.min()) + (1 + 1e-6) * reach),
        points=points,
    )


def _tangents(normal: Array, axis: Array) -> tuple[Array, Array]:
    """Unit vectors along the contact, as far as the normal allows, and across it."""
    tangent = axis - (axis @ normal) * normal
    if np.linalg.norm(tangent) < 1e-6:
        tangent = np.eye(3)[np.argmin(np.abs(normal))]
        tangent = tangent - (tangent @ normal) * normal
    tangent = tangent / np.linalg.norm(tangent)
    return tangent, np.cross(normal, tangent)


def _difference(
    first: MatrixCoordinates, second: MatrixCoordinates, a: int, b: int, direction: Array, size: int
) -> Array:
    row = np.zeros(size)
    for mesh, node, sign in ((first, a, -1.0), (second, b, 1.0)):
        dofs, coefficients = mesh.translation(node, direction.tolist())
        row[dofs] += sign * coefficients
    return row
