"""What a rig file says of its sensors' own responses: their high-passes, and how they sit on their mounts."""

from collections.abc import Callable

import numpy as np

from twin.arrays import Array
from twin.identify.model_modification import ModelModification
from twin.rigs import Rig


def high_pass(corner_Hz: float) -> Callable[[Array], Array]:
    """First order, j omega / (j omega + omega_c): measured over true at omega (f,)."""
    corner = 2 * np.pi * corner_Hz
    return lambda omega: 1j * omega / (1j * omega + corner)


def mounted(frequency_Hz: float, damping_ratio: float) -> tuple[float, float]:
    """Compliance (s2) and lag (s) of a mount that resonates there, see :func:`mount`."""
    omega_0 = 2 * np.pi * frequency_Hz
    return float(omega_0**-2), float(2 * damping_ratio / omega_0)


def mount(compliance_s2: float, lag_s: float) -> Callable[[Array], Array]:
    """A transducer that rides on its mount, as the base excitation of one degree of freedom.

    Parameters
    ----------
    compliance_s2
        Displacement on the mount per acceleration of the base: 1 / omega_0^2 of the mounted resonance.
    lag_s
        By which its damping delays the reading well below: 2 zeta / omega_0.
    """

    def factor(omega: Array) -> Array:
        return np.asarray(1 / (1 - compliance_s2 * omega**2 + 1j * lag_s * omega))

    return factor


def nominal_instruments(rig: Rig) -> ModelModification:
    """The factors of all channels, force cell included; empty where all channels have one and the same high-pass.

    Responses are per force, so what all channels have in common shows nowhere.
    """
    alike = len({sensor.high_pass for sensor in rig.sensor}) == 1
    whole = ModelModification()
    for sensor in rig.sensor:
        factors = [high_pass(sensor.high_pass)] if sensor.high_pass > 0 and not alike else []
        if sensor.mounting_frequency is not None:
            factors.append(mount(*mounted(sensor.mounting_frequency, sensor.mounting_damping)))
        for factor in factors:
            whole = whole.merged(ModelModification(channel_factor={sensor.channel: factor}))
    return whole
