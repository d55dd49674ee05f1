"""Phases beside the force's: phasors in its frame, and a frequency that follows a resonance by them."""

import math
from collections.abc import Mapping

import numpy as np

from recordings.directions import cosine
from recordings.quantities import quantity
from recordings.run import Channel
from twin.procedures.session import Session
from twin.procedures.sine_fit import SineFit
from twin.procedures.steps.amplitude import wrapped


def resonance_phase(response: Channel, force: Channel) -> float:
    """Phase of a response ahead of the force at phase resonance, rad, where the displacement lags by a quarter turn."""
    turned = math.pi if cosine(response.direction, force.direction) < 0 else 0.0
    return wrapped((quantity(response.quantity).derivative - 1) * math.pi / 2 + turned)


def relative_phasors(session: Session, fits: Mapping[str, SineFit], target: str) -> dict[str, complex]:
    """Phasors relative to the phase of the force: at rest once settled, whatever the clocks of the devices do."""
    force = session.force_channel
    name = force.name if force is not None and force.name in fits else target
    reference = fits[name].phasor if name in fits else next(iter(fits.values())).phasor
    turn = np.conj(reference) / max(abs(reference), 1e-300)
    return {channel: complex(fit.phasor * turn) for channel, fit in fits.items()}


def nearness(session: Session, turned: Mapping[str, complex], response: str) -> float | None:
    """cos2 of the phase a response is away from phase resonance: 1 there, small far away; None if it is not known."""
    force = session.force_channel
    if force is None or force.name not in turned or response not in turned or response == force.name:
        return None
    off = float(np.angle(turned[response])) - resonance_phase(session.channels[response], force)
    return math.cos(off) ** 2


class PhaseLock:
    """Chooses the frequency of the next window.

    Near a resonance the phase e above its target obeys e' = -e/tau - 2 pi (f - f_resonance), whatever the amplitude
    and the rig: only tau is to be known, and that roughly.  The law f = P e + I (integral of e) places both poles of
    the loop at half of a = 1/tau + 2 pi P, nearly critically damped (0.8).

    Parameters
    ----------
    widest_Hz
        How far it may go from there.
    target
        Phase of the response ahead of the force, rad.
    deadband
        Phase error within which the frequency stays, rad.
    """

    def __init__(
        self, *, start_Hz: float, widest_Hz: float, target: float, deadband: float, time_constant_s: float
    ) -> None:
        self._low_Hz, self._high_Hz = start_Hz - widest_Hz, start_Hz + widest_Hz
        self._target, self._deadband, self._tau_s = target, deadband, time_constant_s
        self._last_error: float | None = None
        self.error = math.inf
        """Phase above its target in the last window, rad."""

    def update(self, phase: float, *, frequency_Hz: float, window_s: float) -> float:
        """The next frequency from the phase (rad) that the last window showed."""
        self.error = wrapped(phase - self._target)
        last = self.error if self._last_error is None else self._last_error
        self._last_error = self.error
        if abs(self.error) <= self._deadband and abs(self.error - last) <= self._deadband:
            return frequency_Hz
        proportional = 1.0 / (2 * math.pi * max(self._tau_s / 3.0, 2.0 * window_s))
        decay = 1.0 / self._tau_s + 2 * math.pi * proportional
        integral = (decay / 1.6) ** 2 / (2 * math.pi)
        change = proportional * wrapped(self.error - last) + integral * window_s * self.error
        bound = 0.002 * frequency_Hz
        return min(max(frequency_Hz + min(max(change, -bound), bound), self._low_Hz), self._high_Hz)
