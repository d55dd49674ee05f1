"""The law that was calibrated on the steel lap joint, for any modulus of the layer.

In kind it is the 2011 paper's: a softening of E' that saturates, and a loss modulus in shear that grows with the slip.
On the steel rig, at 120 N and 1.5, 3 and 6 N, the tip's receptance peaks at 1.09, 0.91 and 0.66e-3 m/N (the paper: 1.2,
0.9, 0.65e-3) and the resonance falls by 0.13 Hz from 1.5 to 6 N.  The rig file's own damping of 0.0023 alone would
allow 1.13e-3.  At 540 N the peaks are 1.11, 0.98 and 0.73e-3 m/N, and the fall 0.04 Hz.
"""

import numpy as np

from twin.joint.limits import LIMITS
from twin.joint.running_loss import RunningLoss, growing_loss
from twin.joint.saturating import Saturating


def steel_softening(E: float) -> Saturating:
    """What is added to E' times a point's opening, for a layer of normal modulus `E`, N/m2."""
    soft = LIMITS.soft_share * E
    return Saturating(soft, LIMITS.soft_opening * E / LIMITS.reference_modulus, -soft)


def steel_loss(E: float) -> RunningLoss:
    """What a point loses over its slip, for a layer of normal modulus `E`, N/m2."""
    scale = LIMITS.loss_slip * np.sqrt(E / LIMITS.reference_modulus)
    return growing_loss(LIMITS.loss_modulus, scale, LIMITS.loss_power)
