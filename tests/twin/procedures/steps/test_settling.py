"""The settling detector against transients whose remainder is known."""

import numpy as np
import pytest

from twin.procedures.steps.settling import SettlingDetector, usual_rate

WINDOW_S = 0.378


def unknowing(tolerance):
    """A detector that knows no more than what is usual."""
    return SettlingDetector(tolerance, rate=usual_rate(26.45))


def add(detector, k, phasors, stds):
    detector.add(phasors, stds, time_s=k * WINDOW_S)


def feed(detector, tau_s, beat_Hz, size, noise=0.0, seed=1, longest_s=200.0):
    """Windows of 1 + size exp(-t/tau) exp(2 pi i beat t); returns time and remainder when it says settled."""
    rng = np.random.default_rng(seed)
    for k in range(int(longest_s / WINDOW_S)):
        t = k * WINDOW_S
        transient = size * np.exp(-t / tau_s + 2j * np.pi * beat_Hz * t)
        value = 1.0 + transient + noise * (rng.normal() + 1j * rng.normal())
        add(detector, k, {"acc": complex(value)}, {"acc": noise})
        if detector.settled:
            return t, abs(transient)
    return np.inf, abs(transient)


@pytest.mark.parametrize("tau_s", [0.8, 2.6, 6.0])
@pytest.mark.parametrize("beat_Hz", [0.0, 0.05, 0.3, 0.66, 1.3])
def test_what_remains_is_within_the_tolerance_whatever_the_beat(tau_s, beat_Hz):
    when_s, left = feed(unknowing(1e-3), tau_s, beat_Hz, size=0.4, noise=1e-5)
    assert left < 1.3e-3  # the decay itself is known to about a tenth when it matters
    assert when_s < tau_s * np.log(0.4 / 1e-3) + 10 * WINDOW_S  # and it does not wait for nothing


def test_noise_above_the_tolerance_does_not_stop_the_test():
    when_s, left = feed(unknowing(1e-4), 2.6, 0.1, size=0.3, noise=2e-3)
    assert when_s < 40.0
    assert left < 0.02


def test_a_growing_response_is_not_settled():
    detector = unknowing(1e-3)
    for k in range(40):
        add(detector, k, {"acc": 1.0 + 1e-3 * 1.2**k}, {"acc": 1e-6})
    assert not detector.settled


def test_a_dead_channel_is_left_out():
    detector, rng = unknowing(1e-3), np.random.default_rng(2)
    for k in range(20):
        dead = 1e-4 * complex(rng.normal(), rng.normal())
        add(detector, k, {"acc": 1.0 + 0j, "dead": dead}, {"acc": 1e-6, "dead": 1e-4})
    assert detector.settled


def test_too_few_windows_say_nothing():
    detector = unknowing(1e-3)
    for k in range(7):
        add(detector, k, {"acc": 1.0 + 0j}, {"acc": 1e-6})
    assert not detector.settled
    assert detector.remaining == np.inf


@pytest.mark.parametrize("beat_Hz", [0.3, 0.9])
def test_four_windows_are_enough_where_the_decay_is_known(beat_Hz):
    rate = -1 / 2.6 + 2j * np.pi * beat_Hz
    detector = SettlingDetector(1e-3, rate=rate, certain=True)
    for k, t in enumerate([0.0, 0.378, 1.2, 1.578]):  # with a pause, as on a wire
        detector.add({"acc": 2.0 + 0.1 * np.exp(rate * t)}, {"acc": 1e-6}, time_s=t)
        assert bool(detector.split()) == (k == 3)
    steady, left = detector.split()["acc"]
    assert steady == pytest.approx(2.0, abs=1e-9)
    assert left == pytest.approx(0.1 * np.exp(rate * 1.578), abs=1e-9)


def test_four_windows_are_not_enough_for_a_slow_decay_without_a_beat():
    detector = SettlingDetector(1e-3, rate=-1 / 6.0 + 0j, certain=True)
    for k in range(4):
        add(detector, k, {"acc": 1.0 + 0j}, {"acc": 1e-6})
    assert not detector.settled
