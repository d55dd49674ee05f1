"""Phase resonance: the frequency follows the resonance by the phase between force and response."""

from __future__ import annotations

import math

from recordings.run import Channel
from twin.procedures.amplitude import wrapped

__all__ = ["PhaseLock", "resonance_phase"]

_PHASE = {"displacement": -math.pi / 2, "velocity": 0.0, "acceleration": math.pi / 2}


def resonance_phase(response: Channel, force: Channel) -> float:
    """Phase of a response ahead of the force at phase resonance, rad, where the displacement lags by a quarter turn."""
    turned = 0.0 if response.direction == force.direction else math.pi
    return wrapped(_PHASE[response.quantity] + turned)


class PhaseLock:
    """Chooses the frequency of the next window.

    Near a resonance of time constant tau the phase follows the frequency like a first-order lag with the gain
    -2 pi tau, whatever the amplitude, so a proportional-integral law whose zero cancels tau needs no other knowledge of
    the rig: df = [e_k - e_(k-1) + (T/tau) e_k] / (2 pi lambda), e the phase above its target, lambda the closed loop's
    time.

    Parameters
    ----------
    start_Hz
        Where it starts.
    widest_Hz
        How far it may go from there.
    target
        Phase of the response ahead of the force, rad.
    deadband
        Phase error within which the frequency stays, rad.
    time_constant_s
        tau.
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
        closed_s = max(self._tau_s / 3.0, 2.0 * window_s)
        change = (wrapped(self.error - last) + window_s / self._tau_s * self.error) / (2 * math.pi * closed_s)
        bound = 0.002 * frequency_Hz
        return min(max(frequency_Hz + min(max(change, -bound), bound), self._low_Hz), self._high_Hz)
