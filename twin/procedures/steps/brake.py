"""Stopping a transient instead of waiting for it: a short detour of the frequency.

After a step the response differs from its steady state by a transient that takes several time constants to die, 10 s
and more for a structure of Q = 200.  Away from the resonance it beats.  A detour f + d of the frequency for T turns the
phase of the force by 2 pi d T, and with it the steady state that the response is compared with: the right detour turns
it so that what is left of the transient is next to nothing.  Neither force nor response ever exceed what they would
have been.

In the frame of the force's phase, with z the response, z1 its steady state and c what is left between them,

    c' = (s - i w) c - i w z1,     c = z - z1,   w = 2 pi d,   s = -1/tau + 2 pi i (f0 - f)

whose solution over T is c(T) = exp(s' T) c(0) - i w z1 (exp(s' T) - 1)/s',  s' = s - i w.
"""

import math
from dataclasses import dataclass

import numpy as np

from twin.procedures.limits import LIMITS
from twin.procedures.session import Session
from twin.procedures.steps.settling import SettlingDetector

SHORTEST_S, LONGEST_S = 0.2, 1.0


@dataclass(frozen=True, kw_only=True)
class Detour:
    """A change of frequency for a while; `left` is what it leaves of the transient compared with just waiting."""

    shift_Hz: float
    duration_s: float
    left: float


def window_gain(rate: complex, length_s: float) -> complex:
    """A transient's mean over a window, over its value in the window's middle."""
    half = 0.5 * rate * length_s
    return complex(np.sinh(half) / half) if abs(half) > 1e-9 else 1.0 + 0j


def plan_detour(*, rate: complex, transient: complex, steady: complex, durations_s: list[float]) -> Detour | None:
    """The best detour for a transient, or None where waiting is as good.

    Parameters
    ----------
    rate
        s of the transient, 1/s.
    transient, steady
        c and z1 at the detour's start, in the frame of the force's phase.
    durations_s
        What the generator's timing allows.
    """
    if abs(rate.imag) < LIMITS.least_beat * abs(rate.real) or abs(transient) > LIMITS.widest_turn * abs(steady):
        return None
    best: Detour | None = None
    for duration_s in durations_s:
        w = np.linspace(-LIMITS.widest_turn, LIMITS.widest_turn, 241) / duration_s
        turned = rate - 1j * w
        grown = np.exp(turned * duration_s)
        after = abs(grown * transient - 1j * w * steady * (grown - 1) / turned)
        i = int(np.argmin(after))
        left = float(after[i]) / (abs(transient) * math.exp(rate.real * duration_s))
        if best is None or left < best.left:
            best = Detour(shift_Hz=float(w[i]) / (2 * math.pi), duration_s=duration_s, left=left)
    return best if best is not None and best.left < 0.4 else None


class Brake:
    """Takes detours during one wait.

    Parameters
    ----------
    tolerance
        A transient below twice this part of the response is left to die by itself.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance, self._left = tolerance, 4

    def act(self, session: Session, detector: SettlingDetector, *, length_s: float, end_ns: int) -> int | None:
        """Take a detour if there is one worth taking, after a window of `length_s` that ended at `end_ns`.

        The time from which the generator is back; None without a detour.
        """
        split = {name: both for name, both in detector.split().items() if name != session.reference_channel}
        if not self._left or not detector.certain or not split or detector.remaining < 2 * self._tolerance:
            return None
        steady, mean = max(split.values(), key=lambda both: abs(both[1]))
        ahead_s = 0.5 * length_s + max(0, session.expected_ns() - end_ns) * 1e-9
        transient = complex(mean / window_gain(detector.rate, length_s) * np.exp(detector.rate * ahead_s))
        block_s = session.stream.block_s
        durations_s = [n * block_s for n in range(1, 2 + int(LONGEST_S / block_s)) if n * block_s > SHORTEST_S]
        detour = plan_detour(rate=detector.rate, transient=transient, steady=steady, durations_s=durations_s)
        if detour is None:
            return None
        self._left -= 1
        frequency_Hz, voltage_V = session.frequency_Hz, session.voltage_V
        began_ns = session.set_sine(frequency_Hz + detour.shift_Hz, voltage_V)
        session.stream.wait(began_ns + round(detour.duration_s * 1e9) - session.latency_ns)
        back_ns = session.set_sine(frequency_Hz, voltage_V)
        detector.restart()
        return back_ns
