"""The Iwan network: many equal springs in parallel, whose sliders slip one after the other (micro-slip).

The density of slip forces is phi^chi up to the last one, phi_1.  chi = 0 is Iwan's own network, and its loops are
parabolas; Segalman's joints have -1 < chi < 0, and lose energy as A^(3 + chi) in micro-slip.  Up to x_1 = phi_1/k

    backbone  F(x) = k x (1 - (x/x_1)^(chi + 1) / (chi + 2))

and beyond x_1 all slip.
"""

import numpy as np

from twin.joint.jenkins_element import ParallelJenkins


def iwan(stiffness_N_per_m: float, slip_force_N: float, *, sliders: int = 10, chi: float = 0.0) -> ParallelJenkins:
    """The network with a number of sliders, each of which stands for an equal share of the springs.

    Parameters
    ----------
    stiffness_N_per_m
        Of all springs, none slipping.
    slip_force_N
        Of all sliders, all slipping.
    chi
        Exponent of the density, above -1.

    Raises
    ------
    ValueError
        If `chi` is not above -1 or there is no slider.
    """
    if chi <= -1.0 or sliders < 1:
        raise ValueError(f"an Iwan network needs chi above -1 and a slider at least, got {chi} and {sliders}")
    levels = ((np.arange(sliders) + 0.5) / sliders) ** (1.0 / (chi + 1.0))
    levels *= slip_force_N / levels.sum()
    return ParallelJenkins((stiffness_N_per_m / sliders,) * sliders, tuple(float(level) for level in levels))
