"""What transverse shear in all beams changes in the assembled matrices, with the derivative by the shear ratio."""

import numpy as np
from numpy.typing import NDArray

from studies.shear_derivatives import timoshenko_mass_derivative, timoshenko_stiffness_derivative
from twin.structure.assembly import add_chain
from twin.structure.beam import beam_mass, beam_stiffness
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure
from twin.structure.timoshenko import timoshenko_mass

Matrix = NDArray[np.float64]


def shear_change(structure: Structure, shear_ratio: float) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """What all beams of an Euler-Bernoulli `structure` gain when their E/(kappa G) is `shear_ratio`.

    Returns
    -------
    M_change, K_change, dM, dK : ndarray, (n, n)
        To be added to M and K0, and their derivatives with respect to `shear_ratio`.
    """
    size = len(structure.basis)
    total = np.zeros((4, size, size))
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
        add_chain(
            total[0], mesh, timoshenko_mass(**section, length=length) - beam_mass(mass_per_length=m, length=length)
        )
        add_chain(total[1], mesh, thick - beam_stiffness(EA=EA, EI=EI, length=length))
        add_chain(total[2], mesh, timoshenko_mass_derivative(**section, length=length))
        add_chain(total[3], mesh, timoshenko_stiffness_derivative(**bending, length=length))
    M_change, K_change, dM, dK = (structure.basis.T @ A @ structure.basis for A in total)
    return M_change, K_change, dM, dK
