"""A lap joint's natural frequencies under every listed cause that is linear and belongs to the structure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from twin.diagnose.effects import with_effects
from twin.diagnose.models import CAUSES
from twin.diagnose.result import Estimate
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.model import Active, BaseParameter, Change, Matrices
from twin.identify.changed_model import changed_structure
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import UNCHANGED, Attachment, ModelModification
from twin.identify.predict import blank_data
from twin.rigs import Effect, Rig
from twin.structure import Structure

Matrix = NDArray[np.float64]
TERMS = ("normal_modulus", "shear_modulus")
STRUCTURAL = {"beam_modulus", "beam_shear_ratio", "clamp_rad_per_Nm", "layer_gradient", "moduli_factor", "attachments"}
"""What of an extension natural frequencies feel."""
PROBE = 2 * np.pi * np.array([0.0, 50.0, 100.0])
"""Three frequencies that tell a mass and a spring from any other attachment, rad/s."""


@dataclass(frozen=True)
class LapJointFrequencies:
    """The model of `rig` at some of its `preloads`; `source` names the rig in errors.

    `moduli_std` is how far off E' and G' may be beforehand, as standard deviation of their logarithms.
    """

    rig: Rig
    preloads: tuple[str, ...]
    source: str = "rig"
    moduli_std: float = LIMITS.moduli_std

    @property
    def base(self) -> tuple[BaseParameter, ...]:
        """E' and G' at every preload."""
        return tuple(
            BaseParameter(f"{term}[{name}]", getattr(self.rig.moduli(name)[0], term), self.moduli_std)
            for name in self.preloads
            for term in TERMS
        )

    @property
    def conditions(self) -> Mapping[str, Mapping[str, str]]:
        """The preloads."""
        return {name: {term: f"{term}[{name}]" for term in TERMS} for name in self.preloads}

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Of the listed causes those that act on the structure, linearly and without loss."""
        found = []
        for cause in CAUSES.values():
            for label in cause.labels(self._evidence):
                change = Change(cause.name, cause.summary, dict(label), cause.parameters(self._evidence, label))
                if self._acts(self._extension(change, _first_values(change))):
                    found.append(change)
        return tuple(found)

    @property
    def silent(self) -> tuple[str, ...]:
        """All other causes."""
        named = {change.cause for change in self.changes}
        return tuple(name for name in CAUSES if name not in named)

    def matrices(self, active: Active) -> Matrices:
        """The structure with the rig file's own effects and `active`."""
        whole = self._evidence.known
        for change, values in active:
            whole = whole.merged(self._extension(change, values))
        structure, KE, KG = self._plain
        if whole.changes_structure:
            structure = changed_structure(self.rig, whole)
            KE, KG = structure.joints[0].KE, structure.joints[0].KG
        M, K0 = structure.M.copy(), structure.K0.copy()
        for attachment in whole.attachments:
            pair = _mass_and_spring(attachment, structure)
            if pair is not None:
                M += pair[0]
                K0 += pair[1]
        E, G = whole.moduli_factor.get(structure.joints[0].name, UNCHANGED)
        terms = {"normal_modulus": E * KE, "shear_modulus": G * KG}
        return Matrices(M, K0, terms, structure.transverse)

    def extended(self, moduli: Mapping[str, Estimate], active: Active, std: Sequence[Mapping[str, float]]) -> Rig:
        """The rig file with identified moduli at the preloads that were measured, and the changes as effects."""
        effects = [
            Effect(cause=change.cause, parameters={**change.label, **values}, std=dict(errors))
            for (change, values), errors in zip(active, std, strict=True)
        ]
        rig = self.with_moduli({name: estimate.value for name, estimate in moduli.items()})
        return rig.model_copy(update={"effect": [*self.rig.effect, *effects]})

    def with_moduli(self, moduli: Mapping[str, float]) -> Rig:
        """The rig file with these moduli, N/m2, at the preloads that were measured."""
        (joint,) = self.rig.joints
        preload = dict(joint.preload)
        for name in self.preloads:
            preload[name] = preload[name].model_copy(update={term: moduli[f"{term}[{name}]"] for term in TERMS})
        return self.rig.with_joints([joint.model_copy(update={"preload": preload})])

    @cached_property
    def _evidence(self) -> MeasuredData:
        return with_effects(blank_data(self.rig, self.preloads[0]), source=self.source)

    @cached_property
    def _plain(self) -> tuple[Structure, Matrix, Matrix]:
        """The structure that nothing changes, and its layer's stiffness per unit of each modulus."""
        structure = self._evidence.model.structure
        return structure, structure.joints[0].KE, structure.joints[0].KG

    def _extension(self, change: Change, values: Mapping[str, float]) -> ModelModification:
        return CAUSES[change.cause].modification(self._evidence, change.label, values)

    def _acts(self, modification: ModelModification) -> bool:
        empty = ModelModification()
        touched = {f.name for f in fields(ModelModification) if getattr(modification, f.name) != getattr(empty, f.name)}
        structure = self._evidence.model.structure
        plain = all(_mass_and_spring(attachment, structure) is not None for attachment in modification.attachments)
        return bool(touched) and touched <= STRUCTURAL and plain


def require_one_joint(rig: Rig, *, source: str) -> None:
    """Refuse a rig, which `source` names, whose natural frequencies would have to give more moduli, or none.

    Raises
    ------
    InputError
        If the rig has no joint, or several.
    """
    if len(rig.joints) != 1:
        has = f"{len(rig.joints)} joints" if rig.joints else "no joint"
        reason = f"it has {has}; a table of natural frequencies gives the moduli of one"
        raise InputError(source, "joint", reason, "give recordings of broadband noise and of sweeps instead")


def _first_values(change: Change) -> dict[str, float]:
    return {p.name: p.starts[0] if p.starts else (p.lower + p.upper) / 2 for p in change.parameters}


def _mass_and_spring(attachment: Attachment, structure: Structure) -> tuple[Matrix, Matrix] | None:
    """What an attachment adds to M and K; None if it is more than a mass and a spring."""
    rows = np.atleast_2d(attachment.rows(structure))
    D = np.asarray(attachment.stiffness(PROBE), complex)
    spring, mass = D[0], (D[0] - D[1]) / PROBE[1] ** 2
    size = np.abs(D).max()
    if np.abs(D.imag).max() > 1e-9 * size or np.abs(D[2] - (spring - mass * PROBE[2] ** 2)).max() > 1e-9 * size:
        return None
    M, K = (np.diag(part.real) if part.ndim == 1 else part.real for part in (mass, spring))
    return rows.T @ M @ rows, rows.T @ K @ rows
