"""The compiled kernels of a fit, compiled or loaded ahead of the first one: one step, one point of one layer."""

import numpy as np

from twin.identify.limits import LIMITS
from twin.identify.linear.receptance import ModalBasis
from twin.identify.linear.structural_modification import PortPairs, update_receptance
from twin.identify.model_modification import NonlinearForce
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.local_forces import LocalForces, Surroundings
from twin.identify.nonlinear.opening_harmonics import Openings, balance_openings
from twin.identify.slipping import slipping_harmonics


def compile_kernels() -> None:
    """Call each kernel once, those first that take the longest; what is compiled stays in the cache."""
    one, law = np.ones(1), LayerLaw.zero(np.geomspace(0.1, 1.0, 5), np.geomspace(0.1, 1.0, 5))
    layer = LocalForces((), np.ones((1, 2)), np.zeros(1, int))
    layer.balance([law], one, _surroundings(2))
    h, point = len(LIMITS.odd_harmonics), np.ones((1, 1))
    around = np.zeros((1, h, 1, 1), complex)
    openings = Openings(
        point + 0j, 0 * point, point, one, np.zeros(1, int), LIMITS.odd_harmonics, around, around[..., 0], around,
        around[..., 0],
    )  # fmt: skip
    balance_openings([law], openings)
    spring = NonlinearForce(
        row=lambda structure: one, equivalent=lambda a, omega: 0j * a, harmonics=lambda a, count, omega: a
    )
    LocalForces((spring,), np.ones((1, 2)), np.zeros(1, int)).balance([law], one, _surroundings(3))
    basis = ModalBasis(one, one, point, point, point)
    PortPairs.of(basis, point, np.zeros(1, int), outer=1).receptance(basis, one, point + 0j, inner=True)
    update_receptance(np.ones((1, 1, 1), complex), np.zeros(1, int), point + 0j)
    slipping_harmonics(one, 1.0, 1.0, np.zeros(3, complex))


def _surroundings(ports: int) -> Surroundings:
    driven = np.ones((1, ports), complex)
    return Surroundings(np.zeros((1, ports, ports), complex), driven, driven[:, 0], 0 * driven, driven[:, 0])
