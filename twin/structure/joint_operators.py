"""Strain operators of the joints' layers: between beams by their own kinematics, between node pairs by differences."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from twin.arrays import Array
from twin.rigs import Layout, ThinLayer
from twin.structure.elements.thin_layer import LayerRows, ThinLayerElement, space_thin_layer, thin_layer
from twin.structure.limits import LIMITS
from twin.structure.matrix_coordinates import MatrixCoordinates, node_pairs
from twin.structure.mesh import BeamMesh, LayerMesh
from twin.structure.structure import JointOperators, Mesh


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
    turn = np.kron(np.eye(2), first.rotation)
    elements = []
    for n, length in enumerate(np.diff(layer.first)):
        ends = {first: layer.first[n : n + 2], second: layer.second[n : n + 2]}
        dofs = np.concatenate([mesh.node_dofs(s) for mesh in (bottom, top) for s in ends[mesh]])
        element = make(length=length, height=joint.layer_height, width=width)
        elements.append([_among(rows, dofs, turn, size, layer.first[n], length) for rows in element])
    normal, shear = (LayerRows.joined(rows) for rows in zip(*elements, strict=True))
    return JointOperators(
        joint.name, normal, shear, (float(layer.first[0]), float(layer.first[-1])), first.coordinates(normal.at)
    )


def _among(rows: LayerRows, dofs: Array, turn: Array, size: int, begin: float, length: float) -> LayerRows:
    """An element's rows over all displacements, m along the joint; `turn` leads to the beams' axis and normal."""
    B = np.zeros((len(rows.B), size))
    B[:, dofs] = rows.B @ turn
    return replace(rows, B=B, at=begin + length * rows.at)


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
    normal = LayerRows(B[:, 0], weight, at, np.zeros(len(at), np.int64))
    slips = B[:, 1:].reshape(-1, size), np.repeat(weight, 2), np.repeat(at, 2), np.tile([0, 1], len(weight))
    size_of = np.max(np.abs(slips[0]), axis=1)
    moves = size_of > LIMITS.joint_operators_nothing * np.max(size_of, initial=1.0)
    shear = LayerRows(*slips).chosen(moves if moves.any() else slice(None))
    reach = float(np.ptp(at)) or 1.0
    ends = float(at.min()) - 1e-6 * reach, float(at.min()) + (1 + 1e-6) * reach
    return JointOperators(joint.name, normal, shear, ends, points)


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
