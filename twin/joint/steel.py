"""The law that was calibrated on the steel lap joint, for any modulus of the layer.

In kind it is the 2011 paper's: a softening of E' that saturates, and a loss modulus in shear that grows with the slip.
On the steel rig, at 120 N and 1.5, 3 and 6 N, the tip's receptance peaks at 1.09, 0.91 and 0.66e-3 m/N (the paper: 1.2,
0.9, 0.65e-3) and the resonance falls by 0.13 Hz from 1.5 to 6 N.  The rig file's own damping of 0.0023 alone would
allow 1.13e-3.  At 540 N the peaks are 1.11, 0.98 and 0.73e-3 m/N, and the fall 0.04 Hz.
"""

import numpy as np

from twin.joint.running_loss import RunningLoss
from twin.joint.saturating import Saturating

SOFT_SHARE = 0.9
"""Share of E' that the law loses at large amplitudes."""
REFERENCE_MODULUS = 3.9e8
"""E' at which SOFT_OPENING holds, N/m2; the softening starts later in a joint that is clamped harder."""
SOFT_OPENING = 1.0e-6
"""Scale of the softening, m of a point's opening."""
LOSS_MODULUS = 3.0e9
"""Loss modulus in shear at large amplitudes, N/m2: the paper's g2 reaches 1.5e9 within its range."""
LOSS_SLIP = 1.65e-6
"""Scale of the loss, m of a point's slip, at REFERENCE_MODULUS."""
LOSS_POWER = 4
LOSS_END = 6.0
"""End of the loss's table, over its scale."""


def steel_softening(E: float) -> Saturating:
    """What is added to E' times a point's opening, for a layer of normal modulus `E`, N/m2."""
    soft = SOFT_SHARE * E
    return Saturating(soft, SOFT_OPENING * E / REFERENCE_MODULUS, -soft)


def steel_loss(E: float) -> RunningLoss:
    """What a point loses over its slip, for a layer of normal modulus `E`, N/m2."""
    scale = LOSS_SLIP * np.sqrt(E / REFERENCE_MODULUS)
    slip = np.linspace(0.0, LOSS_END * scale, 1025)
    return RunningLoss(slip[-1], LOSS_MODULUS * slip**LOSS_POWER / (slip**LOSS_POWER + scale**LOSS_POWER))
