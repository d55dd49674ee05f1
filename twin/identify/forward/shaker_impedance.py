"""What the shaker holds against motion that its generator did not ask for: harmonics that were not measured."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.rigs.tables import Shaker


def drive_stiffness(drive: Shaker, omega: NDArray[Any]) -> NDArray[Any]:
    """Complex dynamic stiffness (f,) at the drive point, N/m: the stinger in series with armature, suspension and coil.

    The coil is short-circuited by an amplifier that holds the voltage and all but open behind one that holds the
    current; its back-EMF is a dashpot then, and nothing.  An ideal force holds nothing.
    """
    if drive.ideal:
        return np.zeros(np.shape(omega), complex)
    resistance = drive.coil_resistance + (drive.output_resistance if drive.amplifier == "current" else 0.0)
    coil = 1j * omega * drive.force_factor**2 / (resistance + 1j * omega * drive.coil_inductance)
    armature = drive.suspension_stiffness - drive.armature_mass * omega**2 + coil
    return np.asarray(drive.stinger_stiffness * armature / (drive.stinger_stiffness + armature))
