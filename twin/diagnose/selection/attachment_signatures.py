"""Signatures of things attached at one place, whatever their dynamic stiffness Z(omega), from two residuals.

To first order the residual at a frequency changes linearly with the real and with the imaginary part of Z there (with
each on its own, for the joint's law goes by amplitudes).  So the changes by a small mass and by a small damper in its
place tell those by a resonator of any frequency and damping.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.diagnose.limits import LIMITS
from twin.identify.model_modification import Attachment, ModelModification
from twin.identify.residuals.prediction import Prediction
from twin.identify.residuals.residual_model import ResidualModel


class AttachmentSignatures:
    """Changes of a residual by what is attached at one port; found once for each port where more is tried than one.

    Parameters
    ----------
    residual_model, prediction
        Without attachment.
    left_by
        Residual (r,) that a further modification leaves.
    at_the_drive
        The same without what harmonics add by it, which is no matter of the stiffness at the drive frequency.
    """

    def __init__(
        self,
        residual_model: ResidualModel,
        prediction: Prediction,
        left_by: Callable[[ModelModification], Array],
        at_the_drive: Callable[[ModelModification], Array],
    ) -> None:
        self._model, self._residual = residual_model.model, prediction.residual
        self._left_by, self._at_the_drive = left_by, at_the_drive
        self._rows = _Rows.of(residual_model, prediction.blocks)
        self._known: dict[bytes, tuple[Array, Array] | None] = {}

    def change_by(self, modification: ModelModification) -> Array:
        """Change (r,) of the residual by a small modification."""
        attachments = modification.attachments
        alone = len(attachments) == 1 and modification == ModelModification(attachments=attachments)
        ports = attachments[0].rows(self._model.structure) if alone else np.zeros((0, 0))
        key = ports.tobytes()
        if len(ports) != 1:
            return self._residual - self._left_by(modification)
        if key not in self._known:
            self._known[key] = None  # seen once: worth two residuals from the next time on
            return self._residual - self._at_the_drive(modification)
        real, imaginary = self._known[key] = self._known[key] or self._by_unit_stiffness(ports)
        Z = self._rows.values(attachments[0].stiffness)
        return np.asarray(real * Z.real + imaginary * Z.imag)

    def _by_unit_stiffness(self, port: Array) -> tuple[Array, Array]:
        """Changes (r,) by a stiffness of one and of the imaginary unit, m/N."""
        mass_kg = LIMITS.signature_little / np.max((port @ self._model.basis.Phi) ** 2)

        def change(unit: complex) -> Array:
            def stiffness(omega: Array) -> Array:
                return unit * mass_kg * np.abs(omega[:, None]) ** 2

            left = self._at_the_drive(ModelModification(attachments=(Attachment(lambda structure: port, stiffness),)))
            return np.asarray((self._residual - left) / np.abs(self._rows.values(stiffness)))

        return change(1.0), change(1j)


@dataclass(frozen=True)
class _Rows:
    """Frequencies of a residual's rows."""

    omega: tuple[Array, ...]
    """Of each block, rad/s; complex where a step's response still grows."""
    repeated: tuple[int, ...]
    """How many rows of a block follow each other at the same frequency."""
    parts: tuple[int, ...]
    """How often a block's frequencies come again: twice where imaginary parts stand behind real ones."""

    @classmethod
    def of(cls, residual_model: ResidualModel, blocks: tuple[tuple[str, slice], ...]) -> _Rows:
        evidence = residual_model.evidence
        omega, repeated, parts = [], [], []
        for name, block in blocks:
            if name.startswith("broadband"):
                data = evidence.broadband[int(name.split()[1])]
                at, time = data.omega, residual_model.run_times(data, data.omega)
            else:
                at, time = evidence.steps.complex_omega, residual_model.step_times
            omega.append(residual_model.clock(at, time))
            parts.append(1 if name == "steps" else 2)
            repeated.append((block.stop - block.start) // (parts[-1] * len(at)))
        return cls(tuple(omega), tuple(repeated), tuple(parts))

    def values(self, of_omega: Callable[[Array], Array]) -> Array:
        """Values (r,) of a function (f, 1) of frequency."""
        each = [
            np.tile(np.repeat(of_omega(omega)[:, 0], repeated), parts)
            for omega, repeated, parts in zip(self.omega, self.repeated, self.parts, strict=True)
        ]
        return np.concatenate(each)
