"""The linear rig in the frequency domain: accelerances from the measured force to every response channel.

Base parameters, which no experimenter knows well: the layer's E', G' and their loss factors, and the modal damping.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from recordings.quantities import quantity
from twin.identify.receptance import ModalBasis, layer_ports, lowest_modes_basis
from twin.identify.softened import PortPairs
from twin.rigs import Place, Rig
from twin.structure import Structure, assemble

__all__ = ["DAMPED_MODES", "BaseParameters", "LinearModel", "Output", "Ports", "build_linear_model"]

Complex = NDArray[Any]
Real = NDArray[Any]

DAMPED_MODES = 5
"""Modes whose damping ratios are identified; those above keep what is believed."""


@dataclass(frozen=True)
class BaseParameters:
    """E', G' (N/m2), their loss factors, modal damping ratios, and detunings.

    A detuning is the relative error of one natural frequency that no parameter of the model explains: discretisation,
    neglected rotary inertia, a length rounded to tenths of a millimetre.  Its prior is tight.
    """

    E: float
    G: float
    loss_E: float
    loss_G: float
    zeta: Real
    detuning: Real

    @property
    def vector(self) -> Real:
        """(log E, log G, loss_E, loss_G, log zeta ..., detuning ...): the form in which they are identified."""
        return np.concatenate(
            [[np.log(self.E), np.log(self.G), self.loss_E, self.loss_G], np.log(self.zeta), self.detuning]
        )

    @staticmethod
    def from_vector(vector: Real) -> BaseParameters:
        """Inverse of :attr:`vector`."""
        zeta, detuning = vector[4 : 4 + DAMPED_MODES], vector[4 + DAMPED_MODES :]
        return BaseParameters(
            float(np.exp(vector[0])),
            float(np.exp(vector[1])),
            float(vector[2]),
            float(vector[3]),
            np.exp(zeta),
            detuning,
        )

    @property
    def names(self) -> list[str]:
        """Names of the entries of :attr:`vector`."""
        return [
            "log_E",
            "log_G",
            "loss_E",
            "loss_G",
            *(f"log_zeta{i + 1}" for i in range(DAMPED_MODES)),
            *(f"detuning{i + 1}" for i in range(DAMPED_MODES)),
        ]


@dataclass(frozen=True)
class Output:
    """A response channel: what it measures, where, and in which direction."""

    channel: str
    quantity: str
    place: Place
    sign: float = 1.0

    def from_displacement(self, omega: Real) -> Complex:
        """Factor from what is read at its place, the displacement or the strain, to the channel's quantity."""
        return self.sign * (1j * omega) ** self.derivative

    @property
    def derivative(self) -> int:
        """How many times what it reads, displacement or strain, is derived by time."""
        return quantity(self.quantity).derivative


@dataclass(frozen=True)
class Ports:
    """Row operators of the ports, stacked, and where each kind sits in the stack.

    Order: layer normal strains, layer shear strains, damped modal coordinates, drive, outputs, extra ports.
    """

    rows: Real
    normal: slice
    shear: slice
    modal: slice
    drive: int
    outputs: slice
    extra: slice

    @property
    def soft(self) -> slice:
        """The ports whose stiffness base parameters change: the layer's strains."""
        return slice(0, self.shear.stop)


@dataclass(frozen=True)
class LinearModel:
    """A structure, its modal basis at reference moduli, and its ports."""

    structure: Structure
    basis: ModalBasis
    reference_E: float
    reference_G: float
    ports: Ports
    outputs: tuple[Output, ...]

    def with_ports(self, rows: Real) -> LinearModel:
        """The same model with further ports, rows (p, n)."""
        stacked = np.vstack([self.ports.rows[: self.ports.extra.start], rows])
        extra = slice(self.ports.extra.start, len(stacked))
        return replace(self, ports=replace(self.ports, rows=stacked, extra=extra))

    def with_points(self, rows: Real) -> LinearModel:
        """The same model with further ports behind all others, rows (p, n)."""
        return replace(self, ports=replace(self.ports, rows=np.vstack([self.ports.rows, rows])))

    def with_places(self, outputs: tuple[Output, ...], drive_place: Place) -> LinearModel:
        """The same structure driven there, with these outputs and no extra ports."""
        p, s = self.ports, self.structure
        rows = np.vstack([p.rows[: p.drive], s.row(drive_place), *(s.row(output.place) for output in outputs)])
        ports = replace(p, rows=rows, outputs=slice(p.drive + 1, len(rows)), extra=slice(len(rows), len(rows)))
        return replace(self, ports=ports, outputs=outputs)

    def receptance(
        self,
        omega: Real,
        base: BaseParameters,
        *,
        dE: Complex | float = 0.0,
        dG: Complex | float = 0.0,
        inner: bool = True,
        modal: bool = True,
    ) -> Complex:
        """Receptances between all ports with the base parameters and further complex changes of the moduli.

        Parameters
        ----------
        omega : ndarray, (f,)
        dE, dG
            Changes of E', G' beyond E (1 + j loss_E), G (1 + j loss_G): one for all, or one for each frequency.
        inner
            Whether the layer's strains and the modal coordinates are wanted as well, which only sensitivities need;
            NaN without.
        modal
            Whether the modal coordinates are wanted among these, which only sensitivities to their damping and detuning
            need; those to the moduli alone come a good deal faster without.

        Returns
        -------
        ndarray, (f, p, p)
        """
        basis = self.basis.with_damping(base.zeta, base.detuning)
        pairs = self._all_pairs if inner and modal else self._outer_pairs
        return pairs.receptance(basis, omega, self.soft_stiffness(omega, base, dE, dG), inner=inner)

    @cached_property
    def _all_pairs(self) -> PortPairs:
        return PortPairs.of(self.basis, self.ports.rows, np.arange(len(self.ports.rows)))

    @cached_property
    def _outer_pairs(self) -> PortPairs:
        """Without the modal coordinates, which nothing is attached to."""
        count, soft = len(self.ports.rows), self.ports.soft.stop
        return PortPairs.of(self.basis, self.ports.rows, np.r_[:soft, self.ports.drive : count])

    def soft_stiffness(self, omega: Real, base: BaseParameters, dE: Complex | float, dG: Complex | float) -> Complex:
        """Stiffness (f, r) that the base parameters add on the soft ports of the reference structure."""
        p = self.ports
        # The sine convention exp(+j omega t) makes a loss a positive imaginary stiffness.
        SE = base.E * (1 + 1j * base.loss_E) - self.reference_E + np.asarray(dE)
        SG = base.G * (1 + 1j * base.loss_G) - self.reference_G + np.asarray(dG)
        S = np.empty((len(omega), p.soft.stop), complex)
        S[:, p.normal] = np.broadcast_to(SE, len(omega))[:, None]
        S[:, p.shear] = np.broadcast_to(SG, len(omega))[:, None]
        return S

    def output_field(
        self, omega: Real, base: BaseParameters, dE: Complex, dG: Complex, *, at: NDArray[np.intp], springs: Complex
    ) -> Complex:
        """Displacement of the outputs per unit force on every degree of freedom, (f, o, n).

        Parameters
        ----------
        at : ndarray, (q,)
            Further ports,
        springs : ndarray, (f, q)
            and the complex stiffness on them.
        """
        p, basis = self.ports, self.basis.with_damping(base.zeta, base.detuning)
        held = np.concatenate([np.arange(p.soft.stop), at])
        outputs = np.arange(len(p.rows))[p.outputs]
        rows = p.rows[np.concatenate([held, outputs])]
        R = basis.receptance(rows, omega)
        k = len(held)
        S = np.concatenate([self.soft_stiffness(omega, base, dE, dG), springs], axis=1)
        T = S[:, :, None] * np.linalg.inv(np.eye(k) + R[:, :k, :k] * S[:, None, :])
        # By reciprocity: the reference structure driven by the outputs' rows less what the held ports hold back.
        effective = rows[k:] - (R[:, k:, :k] @ T) @ rows[:k]
        return basis.field(effective, omega)

    def to_quantity(self, omega: Real) -> Complex:
        """Factors (f, o) from displacements at the outputs to their channels' quantities."""
        return np.stack([output.from_displacement(omega) for output in self.outputs], axis=1)

    def response(self, R: Complex, omega: Real) -> Complex:
        """Frequency responses (f, o) of the outputs per unit drive force, from receptances R."""
        return R[:, self.ports.outputs, self.ports.drive] * self.to_quantity(omega)

    def sensitivity(self, R: Complex, omega: Real, base: BaseParameters) -> Complex:
        """Sensitivities of the responses to ``base.vector``, (f, o, parameters): products of receptances."""
        into, outputs = R[:, :, self.ports.drive], np.arange(R.shape[1])[self.ports.outputs]
        return self.displacement_sensitivity(R, omega, base, outputs, into) * self.to_quantity(omega)[:, :, None]

    def displacement_sensitivity(
        self, R: Complex, omega: Real, base: BaseParameters, ports: NDArray[np.intp], into: Complex
    ) -> Complex:
        """Sensitivities of the displacements of q ports to ``base.vector``, (f, q, parameters).

        Parameters
        ----------
        into : ndarray, (f, p)
            Displacements of all ports by whatever drives the rig.
        """
        p, out = self.ports, R[:, ports, :]
        E = -np.sum(out[:, :, p.normal] * into[:, None, p.normal], axis=2)[..., None]
        G = -np.sum(out[:, :, p.shear] * into[:, None, p.shear], axis=2)[..., None]
        columns = [
            base.E * (1 + 1j * base.loss_E) * E,
            base.G * (1 + 1j * base.loss_G) * G,
            1j * base.E * E,
            1j * base.G * G,
        ]
        modal = -2j * omega[:, None, None] * out[:, :, p.modal] * into[:, None, p.modal]
        omega_r = self.basis.omega[:DAMPED_MODES]
        shifted = omega_r * np.sqrt(1 + 2 * base.detuning)
        detuned = 2 * omega_r**2 + 2j * base.zeta * omega[:, None] * omega_r**2 / shifted
        stiffness = -out[:, :, p.modal] * into[:, None, p.modal] * detuned[:, None, :]
        return np.concatenate([*columns, modal * (base.zeta * shifted), stiffness], axis=2)


def build_linear_model(
    rig: Rig,
    outputs: list[Output],
    *,
    preload: str | None = None,
    structure: Structure | None = None,
) -> LinearModel:
    """Set up the model of `rig` at one preload.

    Parameters
    ----------
    outputs
        The response channels to predict.
    structure
        Other than the one `rig` describes: a cause that changes the beams, say.

    Raises
    ------
    InputError
        If the rig has not one joint.
    """
    if len(rig.joints) != 1:
        raise InputError(
            rig.name, "joint", f"{len(rig.joints)} joints: so far one joint's moduli and law are identified",
            "rehearse, serve and show this rig; identify one of its joints alone",
        )  # fmt: skip
    structure = structure or assemble(rig)
    (moduli,) = rig.moduli(preload)
    K = structure.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    basis = lowest_modes_basis(structure.M, K, np.asarray(rig.damping.modal_ratio))
    QE, QG = layer_ports(structure.joints[0])
    modal = basis.Phi[:, :DAMPED_MODES].T @ structure.M
    rows = np.vstack([QE, QG, modal, structure.row(rig.drive_place)])
    a, b = len(QE), len(QE) + len(QG)
    c = b + DAMPED_MODES
    none = slice(c + 1, c + 1)
    ports = Ports(rows, slice(0, a), slice(a, b), slice(b, c), c, outputs=none, extra=none)
    model = LinearModel(structure, basis, moduli.normal_modulus, moduli.shear_modulus, ports, ())
    return model.with_places(tuple(outputs), rig.drive_place)


def believed_parameters(rig: Rig, preload: str | None = None) -> BaseParameters:
    """What the rig file says, as a start: published moduli, no joint loss, its modal damping."""
    (moduli,) = rig.moduli(preload)
    zeta = np.asarray(rig.damping.modal_ratio, float)[:DAMPED_MODES]
    zeta = np.concatenate([zeta, np.full(DAMPED_MODES - len(zeta), zeta[-1])])
    return BaseParameters(moduli.normal_modulus, moduli.shear_modulus, 0.0, 0.0, zeta, np.zeros(DAMPED_MODES))
