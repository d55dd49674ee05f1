"""The linear rig from voltage and local forces to local coordinates and channels, as states and as poles.

States: modal displacements and velocities, then what local velocities and then what channels have from the modes left
out, then armature displacement, velocity and coil current, then the sensors' own resonances.  Inputs: generator voltage
(or, without a shaker, the force itself) and the restoring force of each local coordinate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.arrays import Array
from twin.bench.limits import LIMITS
from twin.bench.reduction import ModalModel
from twin.bench.shaker import COORDINATES, ShakerModel

FOLLOWING_s = 1 / (2 * np.pi * LIMITS.modes_below_Hz)
"""Within this the modes left out follow the forces where a rate is read: as fast as the fastest mode that is kept."""


@dataclass(frozen=True)
class ReadOff:
    """One thing to read: a row over the condensed coordinates and its time derivative, or a quantity of the shaker.

    `displacement` has the static share of all modes left out in it.  Velocities and accelerations are those of the kept
    modes; with `static` they have that share, too: under the drive force through its derivatives (between resonances it
    is some thousandths), under the local forces by a mode of its own as fast as the fastest that is kept (a joint that
    softens by 0.8 and loses three times its stiffness moves a tip's share by four parts in ten thousand).  `rate` is
    the velocity of a local coordinate and `integral` the displacement that goes with it: both have the static share
    under all forces, which follows them within FOLLOWING_s.  (The slip of a softened layer is by a third less than that
    of the kept modes.)
    """

    quantity: Literal[
        "displacement", "integral", "rate", "velocity", "acceleration",
        "force", "voltage", "stroke", "armature-velocity", "current", "reference", "command",
    ]  # fmt: skip
    row: Array | None = None
    static: bool = False

    @property
    def lags(self) -> bool:
        """Whether it has a static share under local forces that a mode of its own gives."""
        return self.static and self.quantity in ("velocity", "acceleration")


@dataclass(frozen=True)
class LinearRig:
    """dx/dt = A x + B u, y = C x + D u; u is the generator's output, then the local restoring forces."""

    A: Array
    B: Array
    C: Array
    D: Array

    def transfer(self, frequency_Hz: Array) -> Array:
        """Frequency responses, (len(frequency), outputs, inputs)."""
        s = 2j * np.pi * np.atleast_1d(frequency_Hz)
        identity = np.eye(len(self.A))
        return np.array([self.C @ np.linalg.solve(value * identity - self.A, self.B) + self.D for value in s])


@dataclass(frozen=True)
class Poles:
    """The same rig diagonal: one of each conjugate pair, so that y = Re(C w) + D u and dw/dt = lambda w + B u.

    `to_poles` turns states into w, `to_states` w into states (real part of the product).
    """

    pole: Array
    B: Array
    C: Array
    D: Array
    to_poles: Array
    to_states: Array


@dataclass(frozen=True, eq=False)
class Inputs:
    """Where forces act on the r condensed coordinates of the structure, and on the shaker."""

    drive_row: Array
    drive_load: Array
    """What the stinger feels, and where its force goes, (r,): they differ where the clamp moves with the force."""
    loads: Sequence[Array]
    """Patterns (r,) of the structure's local coordinates; their restoring forces act with the opposite sign."""
    shaker_loads: Sequence[str] = ()
    """Local coordinates of the shaker that follow them, from :data:`twin.bench.shaker.COORDINATES`: forces on the
    armature, and voltages in the coil, likewise restoring."""


def linear_rig(
    modal: ModalModel,
    inputs: Inputs,
    outputs: Sequence[ReadOff],
    *,
    damping: Array,
    shaker: ShakerModel | None = None,
    cell_mass: float = 0.0,
) -> LinearRig:
    """Couple the modes with the shaker.

    Parameters
    ----------
    modal
        Structure in r condensed coordinates.
    damping : ndarray, (m, m)
        Of the modes, 2 zeta omega on the diagonal, and of viscous dampers.
    shaker
        None applies the first input as a force.
    cell_mass
        Mass between stinger and force cell, kg: the structure's matrices have it, and the cell does not feel it.
    """
    Phi, m, R = modal.Phi, len(modal.omega), modal.residual
    drive_row, drive_load, loads, shaker_loads = inputs.drive_row, inputs.drive_load, inputs.loads, inputs.shaker_loads
    followers = [output.row for output in outputs if output.quantity == "rate" and output.row is not None]
    slow = [output.row for output in outputs if output.lags and output.row is not None] if loads else []
    own, x = 2 * m + len(followers), 2 * m + len(followers) + 2 * len(slow)
    size = x + (3 if shaker else 0)
    count = 1 + len(loads) + len(shaker_loads)
    q, dq = slice(0, m), slice(m, 2 * m)
    patterns = -np.column_stack([*loads]) if loads else np.zeros((len(Phi), 0))

    # Force on the structure along `drive_load`, as a row over states and one over inputs.
    F_x, F_u = np.zeros(size), np.zeros(count)
    if shaker:
        k = shaker.series_stiffness(float(drive_row @ R @ drive_load))
        F_x[x] = k
        F_x[q] = -k * (drive_row @ Phi)
        F_u[1 : 1 + len(loads)] = -k * (drive_row @ R @ patterns)
    else:
        F_u[0] = 1.0

    A, B = np.zeros((size, size)), np.zeros((size, count))
    A[q, dq] = np.eye(m)
    A[dq, q] = -np.diag(modal.omega**2)
    A[dq, dq] = -damping
    A[dq] += np.outer(Phi.T @ drive_load, F_x)
    B[dq] = np.outer(Phi.T @ drive_load, F_u)
    B[dq, 1 : 1 + len(loads)] += Phi.T @ patterns
    for n, row in enumerate(followers, start=2 * m):
        A[n], B[n] = _static_share(row, R, drive_load, patterns, F_x, F_u)
        A[n, n] -= 1.0
        A[n] /= FOLLOWING_s
        B[n] /= FOLLOWING_s
    for n, row in enumerate(slow):
        at, rate = own + 2 * n, own + 2 * n + 1
        A[at, rate] = 1.0
        A[rate, at], A[rate, rate] = -1 / FOLLOWING_s**2, -np.sqrt(2.0) / FOLLOWING_s
        B[rate, 1 : 1 + len(loads)] = row @ R @ patterns / FOLLOWING_s**2
    if shaker:
        table, v, i = shaker.table, x + 1, x + 2
        A[x, v] = 1.0
        A[v] = -F_x / table.armature_mass
        A[v, x] -= table.suspension_stiffness / table.armature_mass
        A[v, i] += table.force_factor / table.armature_mass
        B[v] = -F_u / table.armature_mass
        A[i, i] = -(table.coil_resistance + shaker.output_resistance) / table.coil_inductance
        A[i, v] = -table.force_factor / table.coil_inductance
        B[i, 0] = shaker.command_gain / table.coil_inductance
        for n, load in enumerate(shaker_loads, start=1 + len(loads)):
            if load in ("stroke", "armature-velocity"):
                B[v, n] = -1.0 / table.armature_mass
            else:
                B[i, n] = -1.0 / table.coil_inductance

    C, D = np.zeros((len(outputs), size)), np.zeros((len(outputs), count))
    lagging = iter(range(own, x, 2))
    for n, output in enumerate(outputs):
        if output.quantity == "force":
            at_cell = cell_mass * (drive_row @ Phi)
            C[n], D[n] = F_x - at_cell @ A[dq], F_u - at_cell @ B[dq]
        elif output.quantity == "voltage":
            D[n, 0] = 1.0
        elif output.quantity in COORDINATES:
            if shaker:
                C[n], D[n, 0] = _of_the_shaker(shaker, output.quantity, size)
            if output.quantity == "command" and "reference" in shaker_loads:
                D[n, 1 + len(loads) + shaker_loads.index("reference")] = -1.0
        else:
            assert output.row is not None
            shape = output.row @ Phi
            if output.quantity == "displacement":
                C[n], D[n] = _static_share(output.row, R, drive_load, patterns, F_x, F_u)
                C[n, q] += shape
            elif output.quantity in ("integral", "rate"):
                follower = 2 * m + next(k for k, row in enumerate(followers) if np.array_equal(row, output.row))
                if output.quantity == "integral":
                    C[n, q], C[n, follower] = shape, 1.0
                else:
                    C[n], D[n] = A[follower], B[follower]
                    C[n, dq] += shape
            else:
                # With a shaker the force is of displacements alone: its first derivative has no input in it.
                share = float(output.row @ R @ drive_load) if output.static and shaker else 0.0
                if output.quantity == "velocity":
                    C[n, dq] = shape
                    C[n] += share * (F_x @ A)
                else:
                    C[n] = shape @ A[dq] + share * (F_x @ A @ A)
                    D[n] = shape @ B[dq] + share * (F_x @ A @ B)
                if output.lags and slow:
                    rate = next(lagging) + 1
                    if output.quantity == "velocity":
                        C[n, rate] += 1.0
                    else:
                        C[n] += A[rate]
                        D[n] += B[rate]
    return LinearRig(A, B, C, D)


def _static_share(
    row: Array, residual: Array, drive_load: Array, patterns: Array, F_x: Array, F_u: Array
) -> tuple[Array, Array]:
    """Displacement of a row through the modes left out, as a row over the states and one over the inputs."""
    flexibility = row @ residual
    by_input = (flexibility @ drive_load) * F_u
    by_input[1 : 1 + patterns.shape[1]] += flexibility @ patterns
    return (flexibility @ drive_load) * F_x, by_input


def _of_the_shaker(shaker: ShakerModel, quantity: str, size: int) -> tuple[Array, float]:
    """Row over the states, and share of the generator's voltage, of one of the shaker's own coordinates."""
    row = np.zeros(size)
    if quantity == "reference":
        return row, shaker.table.amplifier_gain
    if quantity == "command":
        row[-1] = -shaker.output_resistance
        return row, shaker.command_gain
    row[-3 + ("stroke", "armature-velocity", "current").index(quantity)] = 1.0
    return row, 0.0


def with_resonance(rig: LinearRig, output: int, *, frequency_Hz: float, damping_ratio: float) -> LinearRig:
    """Read one output through a second-order transducer of unit gain at low frequency."""
    w, n = 2 * np.pi * frequency_Hz, len(rig.A)
    A = np.zeros((n + 2, n + 2))
    A[:n, :n] = rig.A
    A[n, n + 1] = 1.0
    A[n + 1, :n] = w**2 * rig.C[output]
    A[n + 1, n:] = [-(w**2), -2 * damping_ratio * w]
    B = np.vstack([rig.B, np.zeros(rig.B.shape[1]), w**2 * rig.D[output]])
    C, D = np.column_stack([rig.C, np.zeros((len(rig.C), 2))]), rig.D.copy()
    C[output], D[output] = 0.0, 0.0
    C[output, n] = 1.0
    return LinearRig(A, B, C, D)


def to_poles(rig: LinearRig) -> Poles:
    """Diagonalise, keeping one pole of each conjugate pair."""
    values, vectors = np.linalg.eig(rig.A)
    inverse = np.linalg.inv(vectors)
    keep = values.imag >= 0.0
    weight = np.where(values[keep].imag > 0.0, 2.0, 1.0)
    to_states = vectors[:, keep] * weight
    return Poles(
        pole=values[keep],
        B=(inverse[keep] @ rig.B).astype(complex),
        C=rig.C @ to_states,
        D=rig.D,
        to_poles=inverse[keep],
        to_states=to_states,
    )
