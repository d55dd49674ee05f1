"""What harmonic balance solves: the rig's transfer functions at its local coordinates, and the elements on these.

For harmonic k of local coordinate y:  R_k = Y_k - G_yf(j k w) F_k(Y) - G_yu(j k w) U_k.  With the poles in pairs,

    G(s) = D + sum over poles of (r s + t) / (s^2 - 2 Re(lambda) s + |lambda|^2),

r = Re(C B), t = -Re(C B conj(lambda)), which needs real numbers only.
"""

from typing import NamedTuple

import numpy as np

from twin.arrays import Array
from twin.bench.build import Built
from twin.bench.linear import Poles
from twin.response.aft import fourier_basis


class SineDrive(NamedTuple):
    """Frequency (rad/s) and amplitude of the drive."""

    w: float
    amplitude: float


class Addresses(NamedTuple):
    """Of kernels, by their names, for :data:`twin.joint.calling.call_kernel`."""

    transfer: int = 0
    forces: int = 0
    residual: int = 0
    rounding: int = 0
    drive_slope: int = 0
    solve: int = 0
    newton: int = 0
    advance: int = 0


class System(NamedTuple):
    """Arrays for the kernels: P poles, O outputs (local coordinates, then auxiliary rows), I inputs (drive, forces)."""

    poles: Array
    """2 Re(lambda), |lambda|^2, (2, P)."""
    numerators: Array
    """r and t, (2, O, I, P)."""
    D: Array
    """Direct transmission, (O, I)."""
    elements: Array
    """Kind, coordinate and auxiliary row of each element, as in :class:`twin.bench.marching.Elements`, and where its
    kernel is, from :func:`twin.response.aft.aft_kernel`, (4, E)."""
    scale: Array
    parameters: Array
    """Elements, as in :class:`twin.bench.marching.Elements`."""
    basis: Array
    """See :func:`twin.response.aft.fourier_basis`, (n, samples)."""
    at: Addresses = Addresses()
    """Where the kernels are that others call: :func:`twin.response.continuation.with_kernels`."""


def system_of(built: Built, poles: Poles, *, harmonics: int, samples: int) -> System:
    """The local part of a reduced rig."""
    outputs = built.locals + built.auxiliaries
    residue = poles.C[:outputs, None, :] * poles.B.T[None]
    e = built.elements()
    numerators = np.array([residue.real, -(residue * poles.pole.conj()).real])
    return System(
        np.array([2.0 * poles.pole.real, np.abs(poles.pole) ** 2]), numerators, np.ascontiguousarray(poles.D[:outputs]),
        np.array([e.kind, e.coordinate, e.auxiliary, 0 * e.kind]), e.scale, e.parameters,
        fourier_basis(harmonics, samples),
    )  # fmt: skip


def transfer(poles: Poles, rows: slice, w: Array, harmonics: int) -> Array:
    """G of some outputs at the harmonics of frequencies w (rad/s), (len(w), H + 1, outputs, inputs)."""
    s = 1j * np.arange(harmonics + 1) * np.asarray(w)[:, None]
    residue = (poles.C[rows, None, :] * poles.B.T[None]).reshape(-1, len(poles.pole))
    plus, minus = 1.0 / (s[..., None] - poles.pole), 1.0 / (s[..., None] - poles.pole.conj())
    D = poles.D[rows]
    return np.asarray(0.5 * (plus @ residue.T + minus @ residue.conj().T).reshape(*s.shape, *D.shape) + D)
