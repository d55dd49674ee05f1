"""Harmonics of the layer's openings against the same equations solved over the samples of a period."""

from dataclasses import replace

import numpy as np
import pytest
from opening_balance import balance_openings_numpy
from scipy.optimize import root

from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.model_modification import ModelModification, Opening
from twin.identify.nonlinear import opening_harmonics
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots
from twin.identify.nonlinear.opening_harmonics import (
    Openings,
    balance_openings,
    growth_of_more,
    sensitivity,
)
from twin.identify.nonlinear.running_amplitude import running_loss, squares_of
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import RunningLoss, Saturating
from twin.response.aft import running
from twin.rigs import load_rig

E, WEIGHT = 4e8, np.array([0.066, 0.05, 0.066])
SOFT = Saturating(0.8 * E, 1e-6, -0.8 * E)
KNOTS = np.geomspace(2e-8, 2e-5, 80)
LAW = LayerLaw(KNOTS, KNOTS, -SOFT.describing_function(KNOTS).real, np.zeros(80))
"""Fine enough to be the function itself, and reaching beyond all openings."""
SLAP = Opening(gap_m=2e-6, factor=0.6)


@pytest.fixture
def exact(monkeypatch):
    """A law without noise needs no smoothing of its time form, and its table has no corners."""
    monkeypatch.setattr(opening_harmonics, "SHORTEST_WAVE", 0.0)
    monkeypatch.setattr(opening_harmonics, "GRID", 4000)
    opening_harmonics._abel.cache_clear()
    yield
    opening_harmonics._abel.cache_clear()


def openings(orders, seed=0):
    """Three steps of three points of a structure with three modes of its own; in units of the drive's frequency."""
    rng = np.random.default_rng(seed)
    fundamental = 10 ** rng.uniform(-6, -5.3, (3, 3)) * np.exp(1j * rng.uniform(0, 6, (3, 3)))
    secant = WEIGHT * SOFT.describing_function(np.abs(fundamental)).real
    order, shapes = np.array(orders)[:, None, None], rng.standard_normal((3, 3))
    beams, mass = 3e6 * shapes @ shapes.T, 2e5 * np.diag(rng.uniform(0.2, 1, 3))
    layer = (E * WEIGHT + secant)[:, None, None, :] * np.eye(3)
    compliance = np.linalg.inv(layer + beams - order**2 * mass + 0.05j * order * (beams + 1e6 * np.eye(3)))
    driven = 3e-8 * (rng.standard_normal((3, len(orders), 3)) + 1j * rng.standard_normal((3, len(orders), 3)))
    driven = driven * (order[:, :, 0] % 2)
    at_rest = np.tile(WEIGHT, (3, 1)), np.array([E]), np.zeros(3, int)
    slips = np.zeros_like(compliance), np.zeros_like(driven)
    return Openings(fundamental, secant, *at_rest, tuple(orders), compliance, driven, *slips)


def openings_of(laws, joint, orders=LIMITS.odd_harmonics, seed=0):
    """As :func:`openings`, with the secants of these laws at the points of their joints."""
    plain = openings(orders, seed)
    secant = np.empty((3, 3))
    for point, number in enumerate(joint):
        law = laws[number]
        basis = law.softening_basis(np.abs(plain.fundamental[:, [point]]))[:, 0]
        secant[:, point] = -WEIGHT[point] * (basis @ law.softening)
    changed = (secant - plain.secant)[:, None, None, :] * np.eye(3)
    without = np.linalg.inv(plain.compliance)
    compliance = np.linalg.inv(without + changed)
    return replace(
        plain,
        secant=secant,
        compliance=compliance,
        driven=(compliance @ without @ plain.driven[..., None])[..., 0],
        modulus=np.full(len(laws), E),
        joint=np.array(joint),
    )


def law_force(opening, slap):
    """Of the softening, N per weight: odd, but beyond a gap where it opens, where the slope falls."""
    whole = SOFT.force_history(opening) + E * opening
    if slap is not None:
        at_gap = SOFT.force_history(np.array(slap.gap_m)) + E * slap.gap_m
        whole = whole - (1 - slap.factor) * np.maximum(whole - at_gap, 0.0)
    return whole - E * opening


def brute_force(openings, slap, samples=1024):
    """Motion (s, h, p) and the stiffness that comes back (s, p), by a root finder over harmonics of a fine period."""
    t, orders = 2 * np.pi * np.arange(samples) / samples, np.array(openings.orders)
    static, motion, more = orders == 0, [], []
    for a, k, C, driven in zip(
        openings.fundamental, openings.secant, openings.compliance, openings.driven, strict=True
    ):

        def at(X, a=a):
            return (a[:, None] * np.exp(1j * t)).real + np.einsum("hp,ht->pt", X, np.exp(1j * orders[:, None] * t)).real

        def beyond(o, k=k):
            return WEIGHT[:, None] * law_force(o, slap) - k[:, None] * o

        def unpack(x):
            X = x.reshape(2, len(orders), 3) * 1e-6
            return X[0] + 1j * np.where(static[:, None], 0.0, X[1])

        def miss(x, a=a, C=C, driven=driven):
            X = unpack(x)
            spectrum = np.fft.fft(beyond(at(X)), axis=1)[:, orders].T * (np.where(static, 1.0, 2.0) / samples)[:, None]
            left = (X - driven + np.einsum("hpq,hq->hp", C, spectrum)) * 1e6
            # A static opening has no imaginary part: that unknown is its own equation.
            imaginary = np.where(static[:, None], x.reshape(2, len(orders), 3)[1], left.imag)
            return np.concatenate([left.real.ravel(), imaginary.ravel()])

        found = root(miss, np.zeros(2 * len(orders) * 3), tol=1e-11)
        assert np.max(np.abs(found.fun)) < 1e-9
        X = unpack(found.x)
        motion.append(X)
        first = np.fft.fft(WEIGHT[:, None] * law_force(at(X), slap), axis=1)[:, 1] * 2 / samples
        more.append(first / a - WEIGHT * SOFT.describing_function(np.abs(a)).real)
    return np.array(motion), np.array(more)


@pytest.mark.parametrize(
    ("orders", "slap"), [(LIMITS.odd_harmonics, None), (LIMITS.even_too, SLAP)], ids=["softening", "slap"]
)
def test_harmonics_are_those_of_a_root_finder_over_a_finer_period(exact, monkeypatch, orders, slap):
    """Its own force law, sampling and solver; what comes back to the fundamental is hundredths of the softening."""
    monkeypatch.setattr(opening_harmonics, "SAMPLES", 1024)
    given = openings(orders)
    motion, more = brute_force(given, slap)
    found = balance_openings((LAW,), given, (slap,))
    size, softened = np.max(np.abs(motion)), np.max(np.abs(given.secant))
    assert found.unsettled < 1e-7
    np.testing.assert_allclose(found.motion, motion, atol=1e-4 * size)
    np.testing.assert_allclose(found.more, more, atol=1e-4 * softened)
    assert np.max(np.abs(more)) > 0.01 * softened


def test_sixty_four_samples_are_enough(exact):
    given = openings(LIMITS.even_too)
    motion, more = brute_force(given, SLAP)
    found = balance_openings((LAW,), given, (SLAP,))
    np.testing.assert_allclose(found.motion, motion, atol=2e-3 * np.max(np.abs(motion)))
    np.testing.assert_allclose(found.more, more, atol=0.02 * np.max(np.abs(more)))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("slap", [None, SLAP, Opening(5e-7, 0.2)], ids=["softening", "slap", "hard-slap"])
def test_it_comes_to_rest_wherever_it_begins(request, seed, slap):
    if seed == 5 and slap and slap.factor < SLAP.factor:
        told = "one in fifteen of so hard slaps (13 of seeds 0 to 199) is told to be unsettled"
        request.applymarker(pytest.mark.xfail(reason=told, strict=True))
    given = openings(LIMITS.even_too, seed)
    found = balance_openings((LAW,), given, (slap,))
    again = balance_openings((LAW,), given, (slap,), start=1.2 * found.motion)
    assert max(found.unsettled, again.unsettled) < 1e-5
    np.testing.assert_allclose(again.motion, found.motion, atol=1e-4 * np.max(np.abs(given.fundamental)))


@pytest.mark.parametrize("orders", [LIMITS.odd_harmonics, LIMITS.even_too], ids=["odd", "all"])
@pytest.mark.parametrize("slap", [None, SLAP, Opening(5e-7, 0.2)], ids=["softening", "slap", "hard-slap"])
def test_the_compiled_balance_is_the_plain_one(orders, slap):
    given = openings(orders, seed=1)
    one, two = balance_openings((LAW,), given, (slap,)), balance_openings_numpy(LAW, given, slap)
    for name in ("motion", "force", "more"):
        value = getattr(two, name)
        np.testing.assert_allclose(getattr(one, name), value, atol=1e-8 * np.max(np.abs(value)), rtol=0)


@pytest.mark.parametrize(
    ("orders", "slap"), [(LIMITS.odd_harmonics, None), (LIMITS.even_too, SLAP)], ids=["softening", "slap"]
)
def test_what_harmonics_add_grows_with_the_fundamentals_as_differences_say(exact, orders, slap):
    around, slaps = openings(orders), [slap]
    found = growth_of_more([LAW], around, balance_openings([LAW], around, slaps), slaps)
    for point in range(3):

        def more(part, point=point):
            larger = around.fundamental.copy()
            larger[:, point] *= 1 + part
            return balance_openings([LAW], replace(around, fundamental=larger), slaps).more

        differences = (more(1e-5) - more(-1e-5)) / 2e-5
        np.testing.assert_allclose(found[:, :, point], differences, atol=2e-4 * np.max(np.abs(found)))


@pytest.mark.parametrize("around_Hz", [26.2, 155.5], ids=["mode-1", "mode-2"])
@pytest.mark.parametrize("slap", [None, SLAP, Opening(5e-7, 0.2)], ids=["softening", "slap", "hard-slap"])
def test_it_comes_to_rest_on_a_rig(build, steel_model, steel_dense, around_Hz, slap):
    """The third harmonic of a sweep about mode 2 passes mode 3; mode 1 opens the layer by 7 um."""
    base = nominal_parameters(load_rig("steel-lap-joint"))
    knots = np.geomspace(1e-8, 1e-5, 20)
    law = LayerLaw(knots, knots, -SOFT.describing_function(knots).real, 2e9 * knots**2 / (knots**2 + 1e-12))
    omega = 2 * np.pi * around_Hz * np.tile(np.linspace(0.97, 1.03, 41), 3)
    tip = np.repeat([1e-4, 1e-3, 3e-3], 41) * (26.2 / around_Hz) ** 1.5
    H, motion = steel_dense.with_law(omega, tip, base, law)
    force = tip * omega**2 / np.abs(H[:, 1])
    steps = build.steps(omega, force[:, None], (H * force[:, None])[:, :, None])
    evidence = build.evidence(steel_model, steps)
    lost = ModelModification(opening={evidence.rig.joints[0].name: slap} if slap else {})
    residual_model, baseline = ResidualModel(evidence, lost), BaselineParameters(base, (law,))
    given = residual_model.openings(baseline, residual_model.step_receptance(baseline, inner=False)[2])
    found = balance_openings((law,), given, residual_model.slaps)
    assert found.unsettled < 1e-7
    assert np.max(np.abs(motion[:, :3])) > 2e-6


def test_without_harmonics_nothing_comes_back():
    """A structure that does not answer them, and a drive that has none."""
    given = openings(LIMITS.odd_harmonics)
    still = replace(given, compliance=0 * given.compliance, driven=0 * given.driven)
    found = balance_openings((LAW,), still)
    assert not found.motion.any()
    assert np.max(np.abs(found.more)) < 1e-12 * np.max(np.abs(given.secant))


def test_a_linear_joints_harmonics_are_the_drives_own():
    given = openings(LIMITS.odd_harmonics)
    given = replace(given, secant=0 * given.secant)
    found = balance_openings((LayerLaw.zero(KNOTS, KNOTS),), given)
    np.testing.assert_allclose(found.motion, given.driven, atol=1e-6 * np.max(np.abs(given.driven)))
    assert np.max(np.abs(found.more)) < 1e-6 * E * WEIGHT[0]


def test_a_layer_that_loses_contact_where_it_opens_is_open_in_the_mean():
    """Less force holds it beyond the gap than before: it opens farther than it closes, more so the less is left."""
    given = openings(LIMITS.even_too)
    # One point by itself on a static compliance.
    alone = np.eye(3) * 2e-8 * np.ones((3, len(LIMITS.even_too), 1, 1))
    given = replace(given, compliance=alone + 0j, driven=0 * given.driven)
    mean = [balance_openings((LAW,), given, (Opening(2e-7, factor),)).motion[:, 0].real for factor in (0.9, 0.5)]
    assert np.all(mean[0] > 0)
    assert np.all(mean[1] > mean[0])
    closing = balance_openings((LAW,), given, (Opening(2e-7, 1 / 0.5),)).motion[:, 0].real
    assert np.all(closing < 0)


def test_a_slap_that_loses_nothing_is_none():
    given = openings(LIMITS.even_too)
    plain, factor_1, far = (
        balance_openings((LAW,), given, (slap,)) for slap in (None, Opening(2e-7, 1.0), Opening(1e-4, 0.2))
    )
    even = [LIMITS.even_too.index(h) for h in (0, 2, 4, 6)]
    for found in (plain, factor_1, far):
        assert np.max(np.abs(found.motion[:, even])) < 1e-9 * np.max(np.abs(given.fundamental))
        np.testing.assert_allclose(found.motion, plain.motion, atol=1e-9 * np.max(np.abs(given.fundamental)))


@pytest.mark.parametrize(
    ("orders", "slaps"),
    [(LIMITS.odd_harmonics, (None, None)), (LIMITS.even_too, (SLAP, None))],
    ids=["odd", "slap"],
)
def test_what_harmonics_add_follows_the_laws_of_all_joints(exact, orders, slaps):
    """Against differences of the balance itself, with everything that a law changes built anew."""
    knots = np.geomspace(2e-7, 2e-5, 7)
    softening = -SOFT.describing_function(knots).real
    laws = tuple(LayerLaw(knots, knots, share * softening, np.zeros(7)) for share in (1.0, 0.7))
    joint = (0, 1, 0)
    found = openings_of(laws, joint, orders)
    motion = balance_openings(laws, found, slaps).motion
    none = np.zeros((*motion.shape[:2], 2 * motion.shape[2], 0))
    by_softening, _ = sensitivity(laws, found, motion, none, slaps=slaps)
    step = 1e-4 * E
    for number, knot in ((0, 2), (0, 4), (1, 3)):
        sides = []
        for sign in (1, -1):
            moved = laws[number].softening + sign * step * np.eye(7)[knot]
            changed = tuple(replace(law, softening=moved) if n == number else law for n, law in enumerate(laws))
            sides.append(balance_openings(changed, openings_of(changed, joint, orders), slaps).more)
        expected = (sides[0] - sides[1]) / (2 * step)
        assert np.max(np.abs(expected)) > 1e-4
        np.testing.assert_allclose(by_softening[number][0][:, :, knot], expected, atol=0.02 * np.max(np.abs(expected)))


def test_harmonics_of_the_slip_lower_its_loss_as_the_running_loss_of_the_bench_does():
    """Beside a fundamental of 1 um a third harmonic of a tenth: the running frequency rises, and the coefficient falls.

    The bench's law is asked for its force's fundamental in the same motion.
    """
    omega, slip, third = 1100.0, np.array([[1e-6 + 0j]]), np.array([[[1e-7j]]])
    grid = np.linspace(0.0, 3e-6, 2001)
    bench = RunningLoss(grid[-1], 2e8 * (grid / 1e-6) ** 1.5)
    knots = np.geomspace(1e-8, 3e-6, 60)
    law = LayerLaw(knots, knots, np.zeros(60), bench.modulus(knots))
    velocity = np.zeros(7)
    velocity[2], velocity[5] = -omega * 1e-6, -3 * omega * 1e-7  # of 1 um cos, and of -0.1 um sin(3 .)
    force, by_velocity = np.zeros(7), np.zeros((7, 7))
    parameters = np.atleast_2d(bench.parameters)
    running(parameters, 0, velocity, 0.0, omega, force, by_velocity, np.zeros((2, 7)))
    alone = law.loss_at(np.array([1e-6]))[0] * 1e-6
    found = running_loss([law], np.zeros(1, int), np.abs(slip), squares_of(third, (3,)))[0, 0] * 1e-6
    assert found < 0.98 * alone
    assert found == pytest.approx(-force[2], rel=1e-4)


@pytest.mark.parametrize("onset_m", [5e-7, 1e-6, 3e-6, 1e-5])
@pytest.mark.parametrize("opening_m", [1e-6, 3e-6, 8e-6, 1.5e-5])
def test_the_time_form_of_a_measured_law_has_the_harmonics_of_the_law_itself(onset_m, opening_m):
    """With as many knots as a fit has, and a third harmonic of a seventh, as on a beam whose mode 2 answers it."""
    law = Saturating(0.9 * E, onset_m, -0.9 * E)
    knots = choose_knots(np.array([1.5e-5]), LIMITS.joint_law_knots)
    fitted = LayerLaw(knots, knots, -law.describing_function(knots).real, np.zeros(len(knots)))
    x, force, _ = opening_harmonics._odd_force(fitted, E)
    theta = 2 * np.pi * (np.arange(1024) + 0.5) / 1024
    alone = opening_m * np.cos(theta)
    both = alone + opening_m / 7 * np.cos(3 * theta + 0.5)

    def harmonic(path, order):
        return 2 * np.mean(path * np.exp(-1j * order * theta))

    def true(opening):
        return law.force_history(opening) + E * opening

    def ours(opening):
        return np.sign(opening) * np.interp(np.abs(opening), x, force)

    more, ours_more = (harmonic(f(both), 1) - harmonic(f(alone), 1) for f in (true, ours))
    assert abs(harmonic(ours(both), 3) / harmonic(true(both), 3) - 1) < 0.05
    assert abs(ours_more / more - 1) < 0.05
