"""One linear solve of all finite elements, with the moduli that a law's file gives them: what the bench is held to."""

import numpy as np
from beam_rows import deflection

from twin.structure import assemble, normal_modes


class FullElements:
    """The nominal rig driven at its force cell, damped in its first modes.

    `omega` are their natural frequencies, rad/s.
    """

    def __init__(self, rig, preload):
        self.moduli = rig.joint.preload[preload]
        self.structure = s = assemble(rig, layout=rig.layout(beam_elements=60, layer_elements=6))
        ratios = np.array(rig.damping.modal_ratio)
        modes = normal_modes(s.M, s.stiffness(self.moduli.normal_modulus, self.moduli.shear_modulus), len(ratios))
        self.omega, S = modes.omega, s.M @ modes.Phi
        self.C = (S * (2 * ratios * modes.omega)) @ S.T
        self.position_m = {sensor.channel: sensor.position for sensor in rig.sensor}

    def receptance(self, omega, softening, loss, *, at="acc2"):
        """Displacement at a channel's place per newton, with E' less by `softening` and G' lossy by `loss`."""
        s = self.structure
        K = s.stiffness(self.moduli.normal_modulus - softening, self.moduli.shear_modulus) + 1j * loss * s.joints[0].KG
        load, row = (deflection(s, self.position_m[name]) for name in ("force", at))
        return row @ np.linalg.solve(K + 1j * omega * self.C - omega**2 * s.M, load)
