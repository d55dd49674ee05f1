"""What a layer's moduli owe to the mesh: a layer of few elements is stiffer than one of many, and E' makes up for it.

The steel rig's layer of three elements has the second and the fourth natural frequency of one of six where its E' is a
fifth of a per cent smaller.  Such an error is the same in every mode, however many are measured, so that the
frequencies' own errors, which are independent, do not allow for it.
"""

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import MODULI_STD
from twin.rigs import Rig
from twin.structure import Modes, Structure, assemble, elastic_modes
from twin.structure.sparse import handy


def mesh_errors(own: Structure, rig: Rig, E: Array, G: Array) -> tuple[Array, Array]:
    """Relative errors (j,) of each joint's E' and of its G', N/m2: how far they move when all elements are halved.

    `own` is the structure of `rig` on its file's mesh.

    The moduli of the rig file's mesh are those with which its first natural frequencies are nearest to the finer
    mesh's, as far as one may differ by :data:`LIMITS.frequency_std`.  What halving the elements moves is what is left
    of a mesh whose error falls in proportion to the elements, and three times that of one that converges as fast as it
    should.
    """
    layout = rig.layout()
    if not (layout.joints and layout.beams):  # parts given by matrices have the elements that they have
        return np.zeros(len(E)), np.zeros(len(G))
    modes, fine = (_elastic_modes(each, E, G) for each in (own, assemble(rig, layout=layout.halved())))
    count = min(len(modes.omega), len(fine.omega))
    shift = np.log(fine.omega[:count] / modes.omega[:count])
    Phi = modes.Phi[:, :count]
    energy = [E[i] * np.sum((joint.B_E @ Phi) ** 2, axis=0) for i, joint in enumerate(own.joints)]
    energy += [G[i] * np.sum((joint.B_G @ Phi) ** 2, axis=0) for i, joint in enumerate(own.joints)]
    by_moduli = np.array(energy).T / (2 * modes.omega[:count, None] ** 2)
    precision = by_moduli.T @ by_moduli + (LIMITS.frequency_std / MODULI_STD) ** 2 * np.eye(2 * len(E))
    of_E, of_G = np.split(np.abs(np.linalg.solve(precision, by_moduli.T @ shift)), 2)
    return of_E, of_G


def _elastic_modes(structure: Structure, E: Array, G: Array) -> Modes:
    """The first modes that strain something."""
    K = structure.sparse_K0
    for joint, e, g in zip(structure.joints, E, G, strict=True):
        KE, KG = joint.sparse
        K = K + e * KE + g * KG
    return elastic_modes(handy(structure.sparse_M), handy(K), LIMITS.damped_modes)
