"""A rig's structure at one preload with its modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from twin.arrays import Array
from twin.rigs import Rig, moduli_values
from twin.structure.assembly import assemble
from twin.structure.modes import Modes, normal_modes, rigid_motions
from twin.structure.structure import Structure


@dataclass(frozen=True, eq=False)
class ModelledRig:
    """A rig, its structure, its modes without the rigid ones, and how many of these there are."""

    rig: Rig
    structure: Structure
    modes: Modes
    rigid: int

    @staticmethod
    def of(rig: Rig, structure: Structure, E: Sequence[float] | Array, G: Sequence[float] | Array) -> ModelledRig:
        """Solve for the modes at the joints' moduli E', G', N/m2."""
        modes = normal_modes(structure.M, structure.stiffness(E, G))
        rigid = rigid_motions(modes.omega)
        return ModelledRig(rig, structure, Modes(modes.omega[rigid:], modes.Phi[:, rigid:]), rigid)


def modelled_rig(rig: Rig, *, preload: str | None = None) -> ModelledRig:
    """Assemble a rig and solve for its modes.

    InputError if a file of a part given by matrices cannot be read or does not fit; KeyError if the rig has no such
    preload.
    """
    return ModelledRig.of(rig, assemble(rig), *moduli_values(rig, preload))
