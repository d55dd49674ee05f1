"""Other elements for the layer: the membrane with drilling rotations that the papers cite, and the bare interface.

The membrane is the rectangle of Long, Cen and Long (Advanced Finite Element Method in Structural Engineering, 2009),
nodes on the two neutral axes: bilinear displacements and, from the nodes' rotations, Allman's

    u =  sum_i (h/16) eta_i (1 - eta^2) (1 + xi_i xi) theta_i
    v = -sum_i (l/16) xi_i (1 - xi^2) (1 + eta_i eta) theta_i

so that only differences of rotations strain it.  Its strains are eps_y = dv/dy and gamma = du/dy + dv/dx; the stiffness
along the beams is left out, as in the papers.  The interface has no thickness: it joins the neutral axes themselves.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twin.structure.elements.beam import gauss
from twin.structure.elements.thin_layer import LayerRows, ThinLayerElement, thin_layer
from twin.structure.joint_operators import of_beams
from twin.structure.mesh import BeamMesh, mesh_layers
from twin.structure.structure import Structure

Matrix = NDArray[np.float64]
POINTS = 3
"""Gauss points in each direction; they integrate the squares of the quadratic strains exactly."""

NODES = ((-1.0, -1.0, 0), (1.0, -1.0, 3), (-1.0, 1.0, 6), (1.0, 1.0, 9))
"""xi, eta and first degree of freedom of the nodes: bottom left and right, top left and right."""


def membrane_layer(*, length: float, height: float, width: float) -> ThinLayerElement:
    """Build one membrane element; all lengths in metres."""
    x, w = np.polynomial.legendre.leggauss(POINTS)
    normal, shear, weights = [], [], []
    for xi, w_xi in zip(x, w, strict=True):
        for eta, w_eta in zip(x, w, strict=True):
            weight = np.sqrt(w_xi * w_eta * length * height / 4 * width)
            eps, gamma = _strains(float(xi), float(eta), length, height)
            normal.append(weight * eps)
            shear.append(weight * gamma)
            weights.append(weight / height)
    at = np.repeat(gauss(POINTS)[0], POINTS)
    rows = (LayerRows(np.array(B), np.array(weights), at, np.zeros(len(at), np.int64)) for B in (normal, shear))
    return ThinLayerElement(*rows)


def interface_layer(*, length: float, height: float, width: float) -> ThinLayerElement:
    """Build one zero-thickness element with stiffnesses E'/height and G'/height per area; lengths in metres."""
    return thin_layer(length=length, height=height, width=width, bottom_thickness=0.0, top_thickness=0.0)


def with_layer_element(
    structure: Structure, element: Callable[..., ThinLayerElement], *, joint: int = 0
) -> Structure:  # fmt: skip
    """The same structure with another element in a joint's layer between beams, such as :func:`membrane_layer`."""
    layer = mesh_layers(structure.layout)[joint]
    first, second = (structure.meshes[name] for name in layer.joint.between)
    assert isinstance(first, BeamMesh)
    assert isinstance(second, BeamMesh)
    own = of_beams(layer, first, second, len(structure.basis), make=element).over(structure.basis)
    return replace(structure, joints=tuple(own if n == joint else j for n, j in enumerate(structure.joints)))


def _strains(xi: float, eta: float, length: float, height: float) -> tuple[Matrix, Matrix]:
    """Rows of eps_y and gamma at one point, DOFs (u1, v1, theta1, u2, v2, theta2) bottom, then top."""
    by_x, by_y = 2 / length, 2 / height
    eps, gamma = np.zeros(12), np.zeros(12)
    for xi_i, eta_i, dof in NODES:
        N_x, N_y = xi_i * (1 + eta_i * eta) / 4 * by_x, eta_i * (1 + xi_i * xi) / 4 * by_y
        gamma[dof] = N_y
        eps[dof + 1], gamma[dof + 1] = N_y, N_x
        eps[dof + 2] = -length / 16 * xi_i * (1 - xi**2) * eta_i * by_y
        gamma[dof + 2] = (
            height / 16 * eta_i * (-2 * eta) * (1 + xi_i * xi) * by_y
            + length / 16 * xi_i * 2 * xi * (1 + eta_i * eta) * by_x
        )
    return eps, gamma
