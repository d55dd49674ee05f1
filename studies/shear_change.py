"""What transverse shear in all beams changes in the assembled matrices, with the derivative by the shear ratio."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from studies.shear_derivatives import timoshenko_mass_derivative, timoshenko_stiffness_derivative
from twin.structure.assembly import chain
from twin.structure.elements.beam import beam_mass, beam_stiffness
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure

Matrix = NDArray[np.float64]


def shear_change(structure: Structure, shear_ratio: float) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """What all beams of an Euler-Bernoulli `structure` gain when their E/(kappa G) is `shear_ratio`.

    Returns
    -------
    M_change, K_change, dM, dK : ndarray, (n, n)
        To be added to M and K0, and their derivatives with respect to `shear_ratio`.
    """
    size = structure.sparse_basis.shape[0]
    total = [csr_array((size, size))] * 4
    for mesh in structure.meshes.values():
        if not isinstance(mesh, BeamMesh):
            continue
        beam = mesh.part
        EA, EI = beam.youngs_modulus * beam.area, beam.youngs_modulus * beam.second_moment
        m, radius2 = beam.density * beam.area, beam.second_moment / beam.area
        length = np.diff(mesh.s)
        section = {"mass_per_length": m, "radius2": radius2, "shear_ratio": shear_ratio}
        bending = {"EI": EI, "radius2": radius2, "shear_ratio": shear_ratio}
        thick = beam_stiffness(EA=EA, EI=EI, length=length, shear_ratio=shear_ratio)
        changes = (
            beam_mass(**section, length=length) - beam_mass(mass_per_length=m, length=length),
            thick - beam_stiffness(EA=EA, EI=EI, length=length),
            timoshenko_mass_derivative(**section, length=length),
            timoshenko_stiffness_derivative(**bending, length=length),
        )
        total = [whole + chain(mesh, change, size) for whole, change in zip(total, changes, strict=True)]
    basis = structure.sparse_basis
    M_change, K_change, dM, dK = ((basis.T @ A @ basis).toarray() for A in total)
    return M_change, K_change, dM, dK
