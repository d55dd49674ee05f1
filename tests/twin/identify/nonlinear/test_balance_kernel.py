"""The compiled balance of ports and stiffness against a plain one, turn by turn and to the end."""

import numpy as np
import pytest

from twin.identify.nonlinear.balance_kernel import NewtonLimits, PackedPorts, PackedSliders, Turn, settle
from twin.identify.nonlinear.joint_law import LayerLaw, packed_laws, spline_basis

STEPS, POINTS = 40, 3
KNOTS = np.geomspace(1e-8, 1e-5, 15)
LAW = LayerLaw(KNOTS, 0.3 * KNOTS, 8e7 * KNOTS / (KNOTS + 1e-6), 3e8 * (KNOTS / 1e-6) ** 1.3)


def random_ports(n, seed=0):
    """Surroundings of n ports of a damped structure about its first resonance, where what acts at them matters."""
    rng = np.random.default_rng(seed)
    omega, natural = np.linspace(0.7, 1.3, STEPS), np.array([1.0, 3.0, 4.0, 6.0, 9.0, 14.0, 20.0, 25.0, 30.0, 40.0])
    shapes = 1e-4 * rng.standard_normal((n + 2, len(natural)))
    shapes[n:, 0] = 3e-4
    modal = 1 / (natural**2 - omega[:, None] ** 2 + 0.02j * natural * omega[:, None])
    R = np.einsum("pm,sm,qm->spq", shapes, modal, shapes)
    # The last two drive and tell.
    amplitude = 10 ** rng.uniform(-6.5, -5, STEPS) * np.exp(1j * rng.uniform(0, 6, STEPS))
    more = 1e6 * (rng.standard_normal((STEPS, n)) + 1j * rng.uniform(0, 1, (STEPS, n)))
    growth = 1e6 * (rng.standard_normal((STEPS, POINTS, POINTS)) + 1j * rng.uniform(0, 1, (STEPS, POINTS, POINTS)))
    at = rng.uniform(np.log(1e-7), np.log(1e-6), (STEPS, POINTS))
    return R[:, :n, :n], R[:, :n, n], R[:, n + 1, n], R[:, n + 1, :n], amplitude, more, 0.1 * growth, at


def plain_turn(
    law, weights, among, driven, reference, to_reference, amplitude, more, more_growth, at, own, growth, log_a
):
    """Motion (n,), stiffness (n,), what the assumed amplitudes of one step miss, and Newton's step."""
    p, a = len(weights) // 2, np.exp(log_a)
    (B, B_log), (C, C_log) = spline_basis(law.opening_knots, a[:p]), spline_basis(law.slip_knots, a[p : 2 * p])
    k = np.concatenate([-(B @ law.softening) * weights[:p], 1j * (C @ law.loss) * weights[p:], own]) + more
    k[:p] += more_growth @ (log_a[:p] - at)
    slope = np.concatenate([-(B_log @ law.softening) * weights[:p], 1j * (C_log @ law.loss) * weights[p:], growth])
    held = np.linalg.inv(np.eye(len(k)) + among * k)
    moved, softened = held @ driven, held @ among
    reading = reference - (to_reference * k) @ moved
    to_reading = to_reference - (to_reference * k) @ softened
    # Log motion by stiffness: the port's own, less what the reference channel reads, whose motion is given.
    influence = -softened * moved / moved[:, None] + to_reading * moved / reading
    z = moved / reading * amplitude
    gap = np.log(np.abs(z)) - log_a
    by_amplitude = np.diag(slope)
    by_amplitude[:p, :p] += more_growth
    return z, k, gap, np.linalg.solve(np.eye(len(k)) - (influence @ by_amplitude).real, gap)


NO_SLIDERS = PackedSliders(np.zeros((0, 2)), np.zeros((STEPS, 0, 3), complex), np.zeros((STEPS, 0)), 1e-5, 0)


@pytest.mark.parametrize("forces", [0, 1, 3])
def test_a_turn_is_the_plain_one(forces):
    n = 2 * POINTS + forces
    ports, rng = random_ports(n), np.random.default_rng(1)
    weights = rng.uniform(0.1, 0.3, (STEPS, 2 * POINTS))
    own, growth = (1e5 * (rng.standard_normal((STEPS, forces)) + 0.3j) for _ in range(2))
    log_a = rng.uniform(np.log(1e-9), np.log(3e-5), (STEPS, n))
    out = Turn.of(log_a)
    packed = PackedPorts(*packed_laws((LAW,), np.zeros(POINTS, int)), weights, *map(np.ascontiguousarray, ports))
    settle(packed, own, growth, log_a, np.arange(STEPS), out, NO_SLIDERS, NewtonLimits(0, 1e-10, 0.7, 1 / 64))
    for s in range(STEPS):
        rows = (values[s] for values in (weights, *ports, own, growth, log_a))
        for found, plain in zip(out, plain_turn(LAW, *rows), strict=True):
            np.testing.assert_allclose(found[s], plain, rtol=1e-9, atol=1e-11 * np.max(np.abs(plain)))


def plain_balance(weights, ports, start, turns=200):
    """Newton's method step by step, halved for as long as it does not help."""
    log_a, nothing = np.log(start), np.zeros(0)
    z, _, gap, step = plain_turn(LAW, weights, *ports, nothing, nothing, log_a)
    for _ in range(turns):
        if np.max(np.abs(gap)) < 1e-11:
            break
        share = 1.0
        while True:
            trial = log_a + share * np.clip(step, -0.5, 0.5)
            found = plain_turn(LAW, weights, *ports, nothing, nothing, trial)
            if np.max(np.abs(found[2])) < np.max(np.abs(gap)) or share < 1e-3:
                break
            share /= 2
        log_a, (z, _, gap, step) = trial, found
    return z


def test_what_it_settles_at_is_the_plain_fixed_point_and_where_nothing_is_missed():
    """|d| is |d / response| times what was measured, with the stiffness that goes with |d|."""
    n = 2 * POINTS
    among, driven, reading, onto, amplitude, more, growth, at = ports = random_ports(n)
    weights = np.full((STEPS, n), 0.2)
    start = np.abs(driven / reading[:, None] * amplitude[:, None])
    log_a, nothing = np.log(start), np.zeros((STEPS, 0), complex)
    packed = PackedPorts(*packed_laws((LAW,), np.zeros(POINTS, int)), weights, *map(np.ascontiguousarray, ports))
    out = Turn.of(log_a)
    settle(packed, nothing, nothing, log_a, np.arange(STEPS), out, NO_SLIDERS, NewtonLimits(60, 1e-10, 0.7, 1 / 64))
    z, k = out.motion, out.stiffness
    assert np.all(out.left < 1e-10)
    assert np.median(np.abs(np.log(np.abs(z) / start))) > 0.1, "what acts there matters"
    for s in range(STEPS):
        d = np.linalg.solve(np.eye(n) + among[s] * k[s], driven[s])
        response = reading[s] - onto[s] @ (k[s] * d)
        np.testing.assert_allclose(np.exp(log_a[s]), np.abs(d / response * amplitude[s]), rtol=1e-9)
        np.testing.assert_allclose(z[s], d / response * amplitude[s], rtol=1e-8)
        added = more[s, :3] + growth[s] @ (np.log(np.abs(z[s, :3])) - at[s])
        np.testing.assert_allclose(k[s, :3], -0.2 * LAW.softening_at(np.abs(z[s, :3])) + added, rtol=1e-7)
        np.testing.assert_allclose(k[s, 3:], 0.2j * LAW.loss_at(np.abs(z[s, 3:])) + more[s, 3:], rtol=1e-7)
        plain = plain_balance(weights[s], tuple(values[s] for values in ports), start[s])
        np.testing.assert_allclose(z[s], plain, rtol=1e-6)
