"""What the rig's linear model says that a recording should show; no fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model
from twin.rigs import Rig

REACH = 0.7
"""Of the highest kept mode's frequency, from which on those left out take part."""


@dataclass(frozen=True)
class ExpectedResponse:
    """The nominal rig at one preload, with the damping of its file."""

    model: LinearModel

    @classmethod
    def of(cls, rig: Rig, outputs: Sequence[Output], preload: str) -> "ExpectedResponse":
        """Of the rig's channels, in the order of `outputs`."""
        return cls(build_linear_model(rig, list(outputs), preload=preload))

    @property
    def resonances_Hz(self) -> Array:
        """Natural frequencies, without rigid motions."""
        omega = np.sort(self.model.basis.omega)
        return omega[omega > 1e-3 * omega[-1]] / (2 * np.pi)

    @property
    def unsure(self) -> Array:
        """By what share of itself each resonance moves where all moduli are 10 % off, which no file knows better."""
        basis, ports = self.model.basis, self.model.ports
        order = np.argsort(basis.omega)[-len(self.resonances_Hz) :]
        energy = np.zeros(len(order))
        for parts, moduli in ((ports.normal, self.model.reference_E), (ports.shear, self.model.reference_G)):
            for part, modulus in zip(parts, moduli, strict=True):
                energy += modulus * np.sum((ports.rows[part] @ basis.Phi[:, order]) ** 2, axis=0)
        return 0.05 * energy / basis.omega[order] ** 2

    @property
    def reach_Hz(self) -> float:
        """Up to which frequency the kept modes make the response."""
        return REACH * float(self.resonances_Hz[-1])

    def H(self, frequency_Hz: Array) -> Array:
        """Responses per force (f, o), in the channels' units."""
        ports, omega = self.model.ports, 2 * np.pi * frequency_Hz
        loads, outputs = np.vstack([ports.rows[ports.drive], ports.dampers]), ports.rows[ports.outputs]
        moved = self.model.basis.field(loads[None], omega)
        R, across = moved @ outputs.T, moved @ ports.dampers.T  # (f, 1 + d, o), (f, 1 + d, d)
        viscous = 1j * omega[:, None, None]
        forces = np.linalg.solve(np.eye(len(ports.dampers)) + viscous * across[:, 1:], viscous * R[:, 1:])
        return (R[:, 0] - np.sum(across[:, 0, :, None] * forces, axis=1)) * self.model.to_quantity(omega)
