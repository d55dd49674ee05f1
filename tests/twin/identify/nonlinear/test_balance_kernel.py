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
    squares = 10 ** rng.uniform(-15, -11, (STEPS, POINTS, 2))
    return R[:, :n, :n], R[:, :n, n], R[:, n + 1, n], R[:, n + 1, :n], amplitude, more, 0.1 * growth, at, squares


def plain_turn(
    law, weights, among, driven, reference, to_reference, amplitude, more, more_growth, at, squares, own, growth,
    assumed,
):  # fmt: skip
    """Motion (n,), stiffness (n,), what the assumed motion of one step misses, and Newton's step.

    That is in the real and imaginary parts of all amplitudes, as the text books have it.
    """
    p, a = len(weights) // 2, np.abs(assumed)
    loss, loss_log = running(law, a[p : 2 * p], squares), []
    for side in (1, -1):
        loss_log.append(running(law, a[p : 2 * p] * np.exp(side * 1e-5), squares))
    B, B_log = spline_basis(law.opening_knots, a[:p])
    k = np.concatenate([-(B @ law.softening) * weights[:p], 1j * loss * weights[p:], own]) + more
    k[:p] += more_growth @ (np.log(a[:p]) - at)
    by_loss = (loss_log[0] - loss_log[1]) / 2e-5
    slope = np.concatenate([-(B_log @ law.softening) * weights[:p], 1j * by_loss * weights[p:], growth])
    held = np.linalg.inv(np.eye(len(k)) + among * k)
    moved, softened = held @ driven, held @ among
    reading = reference - (to_reference * k) @ moved
    to_reading = to_reference - (to_reference * k) @ softened
    # Log motion by stiffness: the port's own, less what the reference channel reads, whose motion is given.
    influence = -softened * moved / moved[:, None] + to_reading * moved / reading
    z = moved / reading * amplitude
    by_log = np.diag(slope)
    by_log[:p, :p] += more_growth
    changes = z[:, None] * influence @ by_log
    # The logarithm of a size changes with the parts of its motion.
    of_parts = np.concatenate([np.diag(assumed.real), np.diag(assumed.imag)], axis=1) / np.tile(a**2, 2)
    J = np.eye(2 * len(k)) - np.concatenate([changes.real, changes.imag]) @ of_parts
    real, imaginary = np.split(np.linalg.solve(J, np.concatenate([(z - assumed).real, (z - assumed).imag])), 2)
    return z, k, np.abs(z - assumed) / np.max(np.abs(z)), real + 1j * imaginary


def running(law, amplitude, squares):
    """Loss of slips at their running amplitude, over their running frequency."""
    displacement, velocity = (np.sqrt(amplitude**2 + more) for more in squares.T)
    return law.loss_at(displacement) * displacement / velocity


NO_SLIDERS = PackedSliders(np.zeros((0, 2)), np.zeros((STEPS, 0, 3), complex), np.zeros((STEPS, 0)), 1e-5, 0)


@pytest.mark.parametrize("forces", [0, 1, 3])
def test_a_turn_is_the_plain_one(forces):
    n = 2 * POINTS + forces
    ports, rng = random_ports(n), np.random.default_rng(1)
    weights = rng.uniform(0.1, 0.3, (STEPS, 2 * POINTS))
    own, growth = (1e5 * (rng.standard_normal((STEPS, forces)) + 0.3j) for _ in range(2))
    assumed = np.exp(rng.uniform(np.log(1e-9), np.log(3e-5), (STEPS, n)) + 1j * rng.uniform(0, 6, (STEPS, n)))
    out = Turn.of(assumed)
    packed = PackedPorts(*packed_laws((LAW,), np.zeros(POINTS, int)), weights, *map(np.ascontiguousarray, ports))
    settle(packed, own, growth, assumed, np.arange(STEPS), out, NO_SLIDERS, NewtonLimits(0, 1e-10, 0.7), False)
    for s in range(STEPS):
        rows = (values[s] for values in (weights, *ports, own, growth, assumed))
        for found, plain, exact in zip(out, plain_turn(LAW, *rows), (1e-9, 1e-9, 1e-9, 1e-6), strict=True):
            np.testing.assert_allclose(found[s], plain, rtol=exact, atol=0.01 * exact * np.max(np.abs(plain)))


def test_of_sizes_alone_the_phases_are_those_of_the_motion_that_they_lead_to():
    ports = random_ports(2 * POINTS)
    weights, sizes = np.full((STEPS, 2 * POINTS), 0.2), np.full((STEPS, 2 * POINTS), 1e-6 + 0j)
    packed = PackedPorts(*packed_laws((LAW,), np.zeros(POINTS, int)), weights, *map(np.ascontiguousarray, ports))
    assumed, nothing, out = sizes.copy(), np.zeros((STEPS, 0), complex), Turn.of(sizes)
    settle(packed, nothing, nothing, assumed, np.arange(STEPS), out, NO_SLIDERS, NewtonLimits(0, 1e-10, 0.7), True)
    np.testing.assert_allclose(np.abs(assumed), 1e-6)
    np.testing.assert_allclose(np.angle(assumed / out.motion), 0.0, atol=1e-12)


def plain_balance(weights, ports, start, turns=200):
    """Newton's method step by step, none of which may more than halve or double a motion."""
    assumed, nothing = start, np.zeros(0)
    for _ in range(turns):
        z, _, gap, step = plain_turn(LAW, weights, *ports, nothing, nothing, assumed)
        if np.max(gap) < 1e-11:
            return z
        assumed = assumed + step * np.minimum(1.0, 0.5 * np.abs(z) / np.abs(step))
    return np.full_like(z, np.nan)


def test_what_it_settles_at_is_the_plain_fixed_point_and_where_nothing_is_missed():
    """|d| is |d / response| times what was measured, with the stiffness that goes with |d|."""
    n = 2 * POINTS
    among, driven, reading, onto, amplitude, more, growth, at, squares = ports = random_ports(n)
    weights = np.full((STEPS, n), 0.2)
    start = driven / reading[:, None] * amplitude[:, None]
    assumed, nothing = np.abs(start) + 0j, np.zeros((STEPS, 0), complex)
    packed = PackedPorts(*packed_laws((LAW,), np.zeros(POINTS, int)), weights, *map(np.ascontiguousarray, ports))
    out = Turn.of(assumed)
    settle(packed, nothing, nothing, assumed, np.arange(STEPS), out, NO_SLIDERS, NewtonLimits(60, 1e-10, 2.0), True)
    z, k = out.motion, out.stiffness
    assert np.all(out.left < 1e-10)
    assert np.median(np.abs(np.log(np.abs(z / start)))) > 0.1, "what acts there matters"
    plain = np.empty_like(z)
    for s in range(STEPS):
        d = np.linalg.solve(np.eye(n) + among[s] * k[s], driven[s])
        response = reading[s] - onto[s] @ (k[s] * d)
        np.testing.assert_allclose(assumed[s], d / response * amplitude[s], rtol=1e-8)
        np.testing.assert_allclose(z[s], d / response * amplitude[s], rtol=1e-8)
        added = more[s, :3] + growth[s] @ (np.log(np.abs(z[s, :3])) - at[s])
        np.testing.assert_allclose(k[s, :3], -0.2 * LAW.softening_at(np.abs(z[s, :3])) + added, rtol=1e-7)
        np.testing.assert_allclose(k[s, 3:], 0.2j * running(LAW, np.abs(z[s, 3:]), squares[s]) + more[s, 3:], rtol=1e-7)
        plain[s] = plain_balance(weights[s], tuple(values[s] for values in ports), start[s])
    settled = np.isfinite(plain).all(axis=1)
    assert np.mean(settled) > 0.9
    np.testing.assert_allclose(z[settled], plain[settled], rtol=1e-6)
