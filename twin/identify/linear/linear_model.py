"""The linear rig in the frequency domain: accelerances from the measured force to every response channel.

Base parameters, which no experimenter knows well: the layer's E', G' and their loss factors, and the modal damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from recordings.quantities import quantity
from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.linear.blocks import Blocks
from twin.identify.linear.receptance import ModalBasis, layer_ports, lowest_modes_basis, padded
from twin.identify.linear.structural_modification import PortPairs
from twin.rigs import Place, Rig, moduli_values
from twin.structure import Structure, assemble


@dataclass(frozen=True)
class LinearParameters:
    """E', G' (N/m2) of each joint, their loss factors, modal damping ratios, and frequency discrepancies.

    A frequency discrepancy is the relative error of one natural frequency that no parameter of the model explains:
    discretisation, neglected rotary inertia, a length rounded to tenths of a millimetre.  Its prior is tight.
    """

    E: Array
    G: Array
    loss_E: Array
    loss_G: Array
    """One for each joint, in the rig's order, (j,); a number stands for a single joint's."""
    zeta: Array
    frequency_discrepancy: Array
    """(LIMITS.damped_modes,)."""

    def __post_init__(self) -> None:
        for name in ("E", "G", "loss_E", "loss_G"):
            object.__setattr__(self, name, np.atleast_1d(np.asarray(getattr(self, name), float)))

    @staticmethod
    def blocks(joints: int) -> Blocks:
        """Of :attr:`vector`: the form in which they are identified."""
        layers = [(name, joints) for name in ("log_E", "log_G", "loss_E", "loss_G")]
        return Blocks((*layers, ("log_zeta", LIMITS.damped_modes), ("frequency_discrepancy", LIMITS.damped_modes)))

    def shifted(self, discrepancy: Array | float) -> LinearParameters:
        """The same with natural frequencies that are off by so much more, relative."""
        return replace(self, frequency_discrepancy=self.frequency_discrepancy + discrepancy)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.E)

    @property
    def vector(self) -> Array:
        """All in one vector, see :meth:`blocks`."""
        logs = {"log_E": np.log(self.E), "log_G": np.log(self.G), "log_zeta": np.log(self.zeta)}
        rest = {"loss_E": self.loss_E, "loss_G": self.loss_G, "frequency_discrepancy": self.frequency_discrepancy}
        return self.blocks(self.joints).pack(logs | rest)

    @staticmethod
    def from_vector(vector: Array) -> LinearParameters:
        """Inverse of :attr:`vector`."""
        part = LinearParameters.blocks((len(vector) - 2 * LIMITS.damped_modes) // 4).unpack(vector)
        return LinearParameters(
            E=np.exp(part["log_E"]),
            G=np.exp(part["log_G"]),
            loss_E=part["loss_E"],
            loss_G=part["loss_G"],
            zeta=np.exp(part["log_zeta"]),
            frequency_discrepancy=part["frequency_discrepancy"],
        )

    @property
    def complex_E(self) -> Array:
        """E' with its loss (j,): the convention exp(+j omega t) makes a loss a positive imaginary stiffness."""
        return np.asarray(self.E * (1 + 1j * self.loss_E))

    @property
    def complex_G(self) -> Array:
        """G' with its loss, (j,)."""
        return np.asarray(self.G * (1 + 1j * self.loss_G))


@dataclass(frozen=True)
class Output:
    """A response channel: what it measures, where, in which direction, and what it shows of each mode over that."""

    channel: str
    quantity: str
    place: Place
    sign: float = 1.0
    modal_factor: tuple[float, ...] = ()

    def from_displacement(self, omega: Array) -> Array:
        """Factor from what is read at its place, the displacement or the strain, to the channel's quantity."""
        return self.sign * (1j * omega) ** self.derivative

    @property
    def derivative(self) -> int:
        """How many times what it reads, displacement or strain, is derived by time."""
        return quantity(self.quantity).derivative


@dataclass(frozen=True)
class Ports:
    """Row operators of the ports, and where each kind sits in the stack of all.

    Outer ports come first: the drives, the outputs, extra ports, and what else a prediction looks at.  Inner ones,
    which only sensitivities need, stand behind them.
    """

    outer: Array
    """(p, n)."""
    normals: tuple[Array, ...]
    shears: tuple[Array, ...]
    """Normal and shear strains of each joint's layer, (r, n)."""
    dampers: Array
    """Of the viscous dampers between places, (d, n)."""
    modes: Array
    """Damped modal coordinates, (m, n)."""
    outputs: slice
    extra: slice

    drive: ClassVar[int] = 0

    @cached_property
    def rows(self) -> Array:
        """All of them."""
        return np.vstack([self.outer, *self.normals, *self.shears, self.dampers, self.modes])

    @cached_property
    def normal(self) -> tuple[slice, ...]:
        """Where each joint's normal strains are."""
        return _one_after_another(self.normals, len(self.outer))

    @cached_property
    def shear(self) -> tuple[slice, ...]:
        """Where its shear strains are."""
        return _one_after_another(self.shears, len(self.outer) + sum(map(len, self.normals)))

    @property
    def modal(self) -> slice:
        """Where the modal coordinates are."""
        return slice(len(self.rows) - len(self.modes), len(self.rows))

    @property
    def soft(self) -> slice:
        """The ports with stiffness that the modes of the reference structure lack: the layers' strains, the dampers."""
        return slice(len(self.outer), self.modal.start)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A structure, its modal basis at reference moduli (j,), N/m2, and its ports."""

    structure: Structure
    basis: ModalBasis
    reference_E: Array
    reference_G: Array
    ports: Ports
    outputs: tuple[Output, ...]

    def with_ports(self, rows: Array) -> LinearModel:
        """The same model with other extra ports, rows (p, n)."""
        p = self.ports
        outer = np.vstack([p.outer[: p.extra.start], rows])
        return replace(self, ports=replace(p, outer=outer, extra=slice(p.extra.start, len(outer))))

    def with_points(self, rows: Array) -> LinearModel:
        """The same model with further outer ports behind all others, rows (p, n)."""
        return replace(self, ports=replace(self.ports, outer=np.vstack([self.ports.outer, rows])))

    def with_places(self, outputs: tuple[Output, ...], drives: Sequence[Place]) -> LinearModel:
        """The same structure driven there, with these outputs and no extra ports."""
        return self.with_outputs(outputs, [self.structure.row(place) for place in drives])

    def with_outputs(self, outputs: tuple[Output, ...], drives: Sequence[Array]) -> LinearModel:
        """The same with the rows (n,) of the drives."""
        outer = np.vstack([*drives, *map(self._read_by, outputs)])
        here, none = slice(len(drives), len(outer)), slice(len(outer), len(outer))
        return replace(self, ports=replace(self.ports, outer=outer, outputs=here, extra=none), outputs=outputs)

    def _read_by(self, output: Output) -> Array:
        """Row (n,) of what an output reads of the displacements."""
        row, m = self.structure.row(output.place), len(output.modal_factor)
        shown = (np.asarray(output.modal_factor) - 1) * (row @ self.basis.Phi[:, :m])
        return np.asarray(row + shown @ self.ports.modes[:m])

    def receptance(
        self,
        omega: Array,
        base: LinearParameters,
        *,
        dE: Array | float = 0.0,
        dG: Array | float = 0.0,
        inner: bool = True,
        modal: bool = True,
    ) -> Array:
        """Receptances between all ports with the base parameters and further complex changes of the moduli.

        Parameters
        ----------
        omega : ndarray, (f,)
        dE, dG : (f or 1, j)
            Changes of E', G' beyond E (1 + j loss_E), G (1 + j loss_G), of each joint.
        inner
            Whether inner ports are wanted as well.
        modal
            Whether the modal coordinates are wanted among these, which only sensitivities to their damping and
            frequency discrepancy need; those to the moduli alone come a good deal faster without.  NaN without.

        Returns
        -------
        ndarray, (f, p, p)
            Of the outer ports alone without inner ones.
        """
        basis = self.basis.with_damping(base.zeta, base.frequency_discrepancy)
        pairs = self._all_pairs if inner and modal else self._outer_pairs
        return pairs.receptance(basis, omega, self.soft_stiffness(omega, base, dE, dG), inner=inner)

    @cached_property
    def _all_pairs(self) -> PortPairs:
        p = self.ports
        return PortPairs.of(self.basis, p.rows, np.r_[p.soft, : len(p.outer), p.modal], outer=len(p.outer))

    @cached_property
    def _outer_pairs(self) -> PortPairs:
        """Without the modal coordinates, which nothing is attached to."""
        p = self.ports
        return PortPairs.of(self.basis, p.rows, np.r_[p.soft, : len(p.outer)], outer=len(p.outer))

    def soft_stiffness(self, omega: Array, base: LinearParameters, dE: Array | float, dG: Array | float) -> Array:
        """Dynamic stiffness (f, r) on the soft ports of the reference structure."""
        p = self.ports
        first = p.soft.start
        S = np.empty((len(omega), p.soft.stop - first), complex)
        for parts, moduli in (
            (p.normal, base.complex_E - self.reference_E + dE), (p.shear, base.complex_G - self.reference_G + dG)
        ):  # fmt: skip
            by_joint = np.broadcast_to(moduli, (len(omega), len(parts)))
            for joint, part in enumerate(parts):
                S[:, part.start - first : part.stop - first] = by_joint[:, joint, None]
        S[:, S.shape[1] - len(p.dampers) :] = 1j * np.asarray(omega)[:, None]
        return S

    def output_field(
        self, omega: Array, base: LinearParameters, dE: Array, dG: Array, *, at: NDArray[np.intp], springs: Array
    ) -> Array:
        """Displacement of the outputs per unit force on every degree of freedom, (f, o, n).

        Parameters
        ----------
        at : ndarray, (q,)
            Further ports,
        springs : ndarray, (f, q)
            and the complex stiffness on them.
        """
        p, basis = self.ports, self.basis.with_damping(base.zeta, base.frequency_discrepancy)
        held = np.r_[p.soft, at]
        outputs = np.arange(len(p.rows))[p.outputs]
        rows = p.rows[np.concatenate([held, outputs])]
        R = basis.receptance(rows, omega)
        k = len(held)
        S = np.concatenate([self.soft_stiffness(omega, base, dE, dG), springs], axis=1)
        T = S[:, :, None] * np.linalg.inv(np.eye(k) + R[:, :k, :k] * S[:, None, :])
        # By reciprocity: the reference structure driven by the outputs' rows less what the held ports hold back.
        effective = rows[k:] - (R[:, k:, :k] @ T) @ rows[:k]
        return basis.field(effective, omega)

    def to_quantity(self, omega: Array) -> Array:
        """Factors (f, o) from displacements at the outputs to their channels' quantities."""
        return np.stack([output.from_displacement(omega) for output in self.outputs], axis=1)

    def response(self, R: Array, omega: Array) -> Array:
        """Frequency responses (f, o) of the outputs per unit drive force, from receptances R."""
        return R[:, self.ports.outputs, self.ports.drive] * self.to_quantity(omega)

    def sensitivity(self, R: Array, omega: Array, base: LinearParameters) -> Array:
        """Sensitivities of the responses to ``base.vector``, (f, o, parameters): products of receptances."""
        into, outputs = R[:, :, self.ports.drive], np.arange(R.shape[1])[self.ports.outputs]
        return self.displacement_sensitivity(R, omega, base, outputs, into) * self.to_quantity(omega)[:, :, None]

    def displacement_sensitivity(
        self, R: Array, omega: Array, base: LinearParameters, ports: NDArray[np.intp], into: Array
    ) -> Array:
        """Sensitivities of the displacements of q ports to ``base.vector``, (f, q, parameters).

        Parameters
        ----------
        into : ndarray, (f, p)
            Displacements of all ports by whatever drives the rig.
        """
        p, out = self.ports, R[:, ports, :]
        E, G = np.empty((2, *out.shape[:2], base.joints), complex)
        for joint, (normal, shear) in enumerate(zip(p.normal, p.shear, strict=True)):
            E[:, :, joint] = -np.sum(out[:, :, normal] * into[:, None, normal], axis=2)
            G[:, :, joint] = -np.sum(out[:, :, shear] * into[:, None, shear], axis=2)
        columns = [base.complex_E * E, base.complex_G * G, 1j * base.E * E, 1j * base.G * G]
        modal = -2j * omega[:, None, None] * out[:, :, p.modal] * into[:, None, p.modal]
        omega_r = self.basis.omega[: LIMITS.damped_modes]
        shifted = omega_r * np.sqrt(1 + 2 * base.frequency_discrepancy)
        detuned = 2 * omega_r**2 + 2j * base.zeta * omega[:, None] * omega_r**2 / shifted
        stiffness = -out[:, :, p.modal] * into[:, None, p.modal] * detuned[:, None, :]
        return np.concatenate([*columns, modal * (base.zeta * shifted), stiffness], axis=2)

    def shown_sensitivity(self, into: Array) -> Array:
        """Sensitivities (f, o, o m) of the outputs' displacements to the logarithm of what each shows of each mode.

        Parameters
        ----------
        into : ndarray, (f, p)
            Displacements of all ports, inner ones too, by whatever drives the rig.
        """
        p, outputs = self.ports, len(self.outputs)
        place = p.rows[p.outputs] @ self.basis.Phi[:, : LIMITS.damped_modes]
        change = np.zeros((len(into), outputs, outputs, LIMITS.damped_modes), complex)
        change[:, np.arange(outputs), np.arange(outputs)] = into[:, None, p.modal] * place
        return change.reshape(len(into), outputs, -1)


def build_linear_model(
    rig: Rig, outputs: list[Output], *, preload: str | None = None, structure: Structure | None = None
) -> LinearModel:
    """Set up the model of `rig` at one preload.

    Parameters
    ----------
    outputs
        The response channels to predict.
    structure
        Other than the one `rig` describes: a cause that changes the beams, say.
    """
    structure = structure or assemble(rig)
    E, G = map(np.array, moduli_values(rig, preload))
    K = structure.stiffness(E, G)
    basis = lowest_modes_basis(structure.M, K, np.asarray(rig.damping.modal_ratio))
    strains = [layer_ports(joint) for joint in structure.joints]
    modes, none = basis.Phi[:, : LIMITS.damped_modes].T @ structure.M, slice(0, 0)
    layers = tuple(QE for QE, _ in strains), tuple(QG for _, QG in strains)
    ports = Ports(modes[:0], *layers, structure.B_C, modes, none, none)
    model = LinearModel(structure, basis, E, G, ports, ())
    return model.with_places(tuple(outputs), [*rig.drives.values()])


def _one_after_another(rows: tuple[Array, ...], first: int) -> tuple[slice, ...]:
    """Where each block of rows is in a stack, from `first` on."""
    ends = first + np.cumsum([0, *(len(block) for block in rows)])
    return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def nominal_parameters(rig: Rig, preload: str | None = None) -> LinearParameters:
    """What the rig file says, as a start: published moduli, no joint loss, its modal damping."""
    zeta = padded(np.asarray(rig.damping.modal_ratio), LIMITS.damped_modes)
    E, G = map(np.array, moduli_values(rig, preload))
    offset = rig.natural_frequencies.offset[: LIMITS.damped_modes]
    discrepancy = np.pad(np.asarray(offset, float), (0, LIMITS.damped_modes - len(offset)))
    return LinearParameters(E, G, np.zeros(len(E)), np.zeros(len(E)), zeta, discrepancy)
