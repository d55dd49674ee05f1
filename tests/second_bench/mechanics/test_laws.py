"""What local elements lose in a cycle, against their loops written out."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from tests.second_bench.mechanics.laws import FORGETTING, PARAMETERS, Kind, element_force, saturating

S = 1.6e-6


def lost_in_a_cycle(kind, parameters, *, samples=20000, cycles=4):
    """Work on an element in the last of some cycles of amplitude S, J."""
    padded = np.zeros(PARAMETERS)
    padded[: len(parameters)] = parameters
    path = S * np.sin(2 * np.pi * np.arange(samples * cycles + 1) / samples)
    forces, memory, reach = [0.0], 0.0, 0.0
    for before, now in pairwise(path):
        force, _, memory, reach = element_force(int(kind), padded, now, before, memory, reach, 0.0, 1.0)
        forces.append(force)
    return np.trapezoid(forces[-samples - 1 :], path[-samples - 1 :])


def test_a_slider_loses_what_masing_loops_lose():
    k, force = 1e8, 40.0
    assert lost_in_a_cycle(Kind.SLIDER, (k, force)) == pytest.approx(4 * force * (S - force / k), rel=1e-4)


def test_riding_friction_loses_what_its_loop_encloses():
    friction, slip, travel = 4e7, 1e-6, 1.5e-7

    def force(s):
        way = s + S
        grip = 1 - (1 + np.tanh(S / travel)) * np.exp(-way / travel)
        reach = max(S - FORGETTING * way, abs(s))
        return friction * reach**2 / (slip + reach) * grip

    one_way = quad(force, -S, S, points=[-S + travel, S * (1 - FORGETTING) / (1 + FORGETTING)], epsabs=0, epsrel=1e-9)
    assert lost_in_a_cycle(Kind.RIDING_FRICTION, (0.0, friction, slip, travel, 0.0)) == pytest.approx(
        2 * one_way[0], rel=1e-4
    )


def test_a_loss_knows_no_rate():
    parameters = (0.0, 4e7, 1e-6, 1.5e-7, 0.0)
    slow, fast = (lost_in_a_cycle(Kind.RIDING_FRICTION, parameters, samples=n) for n in (40000, 4000))
    assert slow == pytest.approx(fast, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        (Kind.SOFTENING, (3e7, 0.7, 1e-6, 0.2, 8e-7, 0.5, 3e7)),
        (Kind.CUBIC, (1e6,)),
        (Kind.STOP, (100.0, 1e-6)),
        (Kind.MAGNET, (50.0, 1e-6)),
    ],
)
def test_springs_lose_nothing(kind, parameters):
    assert abs(lost_in_a_cycle(kind, parameters)) < 1e-9 * parameters[0] * S**2


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        (Kind.SOFTENING, (3e7, 0.7, 1e-6, 0.2, 8e-7, 0.5, 3e7)),
        (Kind.RIDING_FRICTION, (1e7, 4e7, 1e-6, 1.5e-7, 2e6)),
        (Kind.SLIDER, (1e8, 400.0)),
        (Kind.CUBIC, (1e6,)),
        (Kind.DASHPOT, (3.0,)),
        (Kind.DRAG, (3.0,)),
        (Kind.MAGNET, (50.0, 1e-6)),
        (Kind.SWINGING, (10.0, 7.0, 3.0)),
    ],
)
@pytest.mark.parametrize("y", [-1.3e-6, 7e-7, 1.1e-6])
def test_tangents_are_derivatives(kind, parameters, y):
    padded = np.zeros(PARAMETERS)
    padded[: len(parameters)] = parameters

    def at(motion):
        return element_force(int(kind), padded, motion, 6e-7, 0.3, 9e-7, 0.1, 1.0)

    h = 1e-11
    assert at(y)[1] == pytest.approx((at(y + h)[0] - at(y - h)[0]) / (2 * h), rel=1e-4)


def test_a_saturating_spring_keeps_what_does_not_saturate():
    force, tangent = saturating(1e-2, 1e7, 0.7, 1e-6, 0.2)
    assert force == pytest.approx(0.3e7 * 1e-2, rel=1e-3)
    assert tangent == pytest.approx(0.3e7, rel=1e-3)
