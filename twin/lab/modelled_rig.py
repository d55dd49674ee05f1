"""A rig's structure at one preload with its natural frequencies: what ``twin rig show`` tells."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.rigs import Rig
from twin.structure import Modes, assemble, normal_modes, rigid_motions
from twin.structure.plausibility import ModelledRig, implausible

__all__ = ["modelled_rig", "rig_table"]

TOLD = 10
"""Natural frequencies that are told at least, as far as there are so many."""


def modelled_rig(rig: Rig, *, preload: str | None = None) -> ModelledRig:
    """Assemble a rig and solve for its modes.

    Parameters
    ----------
    preload
        The rig's first if not given.

    Raises
    ------
    InputError
        If a file of a part given by matrices cannot be read or does not fit.
    KeyError
        If the rig has no such preload.
    """
    structure = assemble(rig)
    moduli = rig.moduli(preload)
    K = structure.stiffness([m.normal_modulus for m in moduli], [m.shear_modulus for m in moduli])
    modes = normal_modes(structure.M, K)
    rigid = rigid_motions(modes.omega)
    return ModelledRig(rig, structure, Modes(modes.omega[rigid:], modes.Phi[:, rigid:]), rigid)


def rig_table(modelled: ModelledRig) -> dict[str, Any]:
    """What ``twin rig show --json`` prints."""
    rig = modelled.rig
    frequencies = modelled.modes.frequency_Hz
    return {
        "natural_frequencies_Hz": np.asarray(frequencies[:TOLD]).tolist(),
        "rigid_modes": modelled.rigid,
        "parts": [part.name for part in modelled.structure.layout.parts],
        "joints": [joint.name for joint in rig.joints],
        "sensors": [sensor.channel for sensor in rig.sensors],
        "warnings": list(implausible(modelled)),
    }
