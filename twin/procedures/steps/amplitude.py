"""Amplitude control: the voltage for the next window from what the last one showed."""

import cmath
import math


class AmplitudeControl:
    """Chooses the generator's voltage; in open loop it is the target."""

    def begin(self) -> None:
        """A new step: phases of earlier windows are void."""

    def update(
        self, measured: complex, *, std: float, target: float, voltage_V: float, window_s: float, nearness: float | None
    ) -> float:
        """The next voltage (peak, V), unlimited; the same as `voltage_V` if the amplitude is held well enough.

        `measured` and `std` are of the held channel in the last window; `nearness` is 1 at phase resonance, 0 far off,
        None while it is not known.
        """
        return target


class FastHold(AmplitudeControl):
    """Holds the force, which follows the voltage at once and the structure's slow response besides.

    The force is F = H V - (what the moving structure takes).  H is nearly the same at all frequencies of a sweep, but
    near a resonance F/V is not H: the structure's reaction can be many times the rest.  A loop that scales V by
    target/|F| overshoots there by H V/F.  So the reaction to a change is learnt: r = (dF/dV)/(F/V), complex, and the
    next voltage solves |F (1 + r dV/V)| = target.  The structure then sees a constant force from the first windows on
    and settles by its own damping alone.

    Parameters
    ----------
    deadband
        Relative error within which the voltage stays: every change starts a small transient.
    """

    def __init__(self, *, deadband: float) -> None:
        self._deadband = deadband
        self._reaction: complex = 1.0
        self._last: tuple[complex, float] | None = None

    def begin(self) -> None:
        """Forget the last window; keep the reaction."""
        self._last = None

    def update(
        self, measured: complex, *, std: float, target: float, voltage_V: float, window_s: float, nearness: float | None
    ) -> float:
        """See :class:`AmplitudeControl`."""
        size = abs(measured)
        if size <= 3 * std or voltage_V <= 0.0:  # nothing seen yet: feel the way up
            self._last = None
            return 3.0 * voltage_V
        if self._last is not None:
            self._learn(measured, voltage_V, *self._last)
        self._last = (measured, voltage_V)
        if abs(size - target) <= max(self._deadband * target, 2 * std):
            return voltage_V
        return voltage_V * (1.0 + self._relative_change(size / target))

    def _learn(self, measured: complex, voltage_V: float, before: complex, voltage_before_V: float) -> None:
        change = voltage_V / voltage_before_V - 1.0
        if abs(change) < 0.03:  # too small to tell from the structure's own slow change
            return
        seen = (measured / before - 1.0) / change
        if 0.2 < abs(seen) < 20.0 and seen.real > 0.0:
            # the ratio refers to the voltage and force before; carry it to those of now
            seen *= (voltage_V / voltage_before_V) / (measured / before)
            self._reaction = 0.5 * self._reaction + 0.5 * seen

    def _relative_change(self, size: float) -> float:
        """The root s of |size (1 + r s)| = 1 nearest to zero, bounded."""
        r = self._reaction
        a, b, c = abs(r) ** 2, r.real, 1.0 - size**-2
        root = b * b - a * c
        # the smaller root of a s^2 + 2 b s + c, written without cancellation
        change = -c / (b + math.sqrt(root)) if root >= 0.0 else -b / a
        return min(max(0.9 * change, -0.7), 4.0)


class SlowHold(AmplitudeControl):
    """Holds a response, which follows the voltage with the resonance's time constant tau.

    At resonance x = ln |X| obeys x' = (ln V - x)/tau, and the law ln V = P e + I (integral of e), e = ln target - x,
    places both poles nearly critically damped at half of a = (1 + P)/tau.  Away from it the amplitude beats at the
    beat frequency, where that gain would be unstable: P fades, and I falls to 0.5/tau, below which the beat is damped.

    Parameters
    ----------
    deadband
        Relative error within which the voltage stays.
    """

    def __init__(self, *, deadband: float, time_constant_s: float) -> None:
        self._deadband, self._tau_s = deadband, time_constant_s
        self._last_error: float | None = None
        self._nearness = 0.0

    def begin(self) -> None:
        """Forget the last window; keep where the resonance was."""
        self._last_error = None

    def update(
        self, measured: complex, *, std: float, target: float, voltage_V: float, window_s: float, nearness: float | None
    ) -> float:
        """See :class:`AmplitudeControl`."""
        size = max(abs(measured), std, 1e-3 * target)
        error = math.log(target / size)
        last = error if self._last_error is None else self._last_error
        self._last_error = error
        # a change of error is acted upon inside the deadband too: it is what stops an overshoot
        if abs(error) <= self._deadband and abs(error - last) <= self._deadband:
            return voltage_V
        self._nearness = self._nearness if nearness is None else nearness
        decay = 1.0 / max(self._tau_s / 2.5, 2.0 * window_s)
        near, far = self._tau_s * (decay / 1.6) ** 2, 0.5 / self._tau_s
        proportional = self._nearness * max(0.0, self._tau_s * decay - 1.0)
        integral = far + self._nearness * max(0.0, near - far)
        change = proportional * (error - last) + integral * window_s * error
        return voltage_V * math.exp(min(max(change, -0.5), 0.5))


def wrapped(angle: float) -> float:
    """An angle brought to -pi .. pi."""
    return cmath.phase(cmath.exp(1j * angle))
