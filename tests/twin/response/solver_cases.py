"""The solvers' cases for tests of their last bits; as a script, their answers into a file: python solver_cases.py OUT.

Every case takes a function that changes its inputs by a hair, and gives its answer as arrays by name.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache

import numpy as np
from beam_rows import deflection

from twin.bench import BenchSetup, JointLaw, no_law, open_bench
from twin.identify.forward.predict import RigResponse, blank_data
from twin.identify.gauss_newton import minimise
from twin.identify.modes import fit_modes
from twin.joint import iwan
from twin.response import HarmonicBalance
from twin.rigs import Effect, LayerLawTable, load_rig
from twin.structure import assemble, normal_modes

STEEL = load_rig("steel-lap-joint")
TIP = 2


def hard(stiffness_N_per_m3):
    return Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": stiffness_N_per_m3})


@cache
def balance(name):
    """Its rig, frequencies and amplitudes."""
    plain = BenchSetup(drive="force", noise=False, converter=False)
    if name == "steel":
        bench = open_bench(STEEL, setup=replace(plain, layout=STEEL.layout()))
        return HarmonicBalance(bench.built, harmonics=7), np.linspace(27.4, 25.4, 33), (0.75, 1.5, 3.0, 6.0)
    if name == "duffing":
        bench = open_bench(STEEL, setup=plain, joint_law=no_law(), effects=[hard(2e7)])
        return HarmonicBalance(bench.built, harmonics=5, samples=128), np.linspace(26.2, 29.0, 29), (1.0, 3.0)
    if name == "kinks":  # at the lower force, friction at rest lets go on the way from rest
        rubbing = Effect(cause="ground-friction", parameters={"position_m": 0.4, "force_N": 0.01})
        bench = open_bench(STEEL, setup=plain, effects=[rubbing])
        return HarmonicBalance(bench.built, harmonics=7), np.linspace(28.0, 25.5, 21), (0.75, 3.0)
    stop = Effect(cause="ground-stop", parameters={"position_m": 0.4, "gap_m": 8e-4, "stiffness_N_per_m": 60.0})
    bench = open_bench(STEEL, setup=plain, joint_law=JointLaw(iwan(1e8, 80.0)), effects=[stop, hard(8e6)])
    return HarmonicBalance(bench.built, harmonics=5, samples=128), np.linspace(25.5, 27.5, 33), (1.0, 3.0)


def moved(one, nudge):
    """The same rig with its poles and laws changed; counts among a law's parameters stay what they are."""
    other = object.__new__(HarmonicBalance)
    other.__dict__.update(one.__dict__)
    s, p = one._system, one._system.parameters
    counts = (p == np.round(p)) & (np.abs(p) < 1e6)
    changed = {name: nudge(getattr(s, name)) for name in ("poles", "numerators", "scale")}
    other._system = s._replace(**changed, parameters=np.where(counts, p, nudge(p)))
    return other


def tips(solutions):
    return np.array([one.channels[TIP, 1] for one in solutions])


def balanced(name, nudge):
    """Sweeps both ways, a branch, and steady states from rest; how many there are, and where the sweeps jumped."""
    one, frequencies, levels = balance(name)
    one, found = moved(one, nudge), {}
    for level in nudge(np.array(levels)):
        at = f"{name} {level:.3g} N"
        for way in (1, -1):
            sweep = one.sweep(nudge(frequencies[::way]), level)
            assert sweep.failures == ()
            found[f"{at} {way:+d}"] = tips(sweep)
            found[f"{at} {way:+d} jumps"] = np.array([solution.jumped for solution in sweep], float)
        branch = one.branch(frequencies[0], frequencies[-1], level)
        assert branch.failure is None
        found[f"{at} branch"] = tips(branch)
        found[f"{at} rest"] = tips([one.solve(f, level) for f in nudge(frequencies[::4])])
    return found


@cache
def responses():
    """Lines, accelerances and their deviations of the steel rig's first modes."""
    s = assemble(STEEL)
    modes = normal_modes(s.M, s.stiffness(3.9e8, 7.6e7), 6)
    f = np.concatenate([np.arange(20.0, 34.0, 1 / 8), np.arange(100.0, 400.0, 1.0)])
    w, W = 2 * np.pi * f[:, None], modes.omega
    shapes = np.array([deflection(s, 0.30), deflection(s, 0.42)]) @ modes.Phi * (deflection(s, 0.05) @ modes.Phi)
    H = -(w**2) * ((1 / (W**2 - w**2 + 2j * 2.5e-3 * W * w)) @ shapes.T)
    rng = np.random.default_rng(1)
    std = 0.01 * (np.abs(H) + np.median(np.abs(H), axis=0))
    return f, H + std * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2), std


def modal(nudge):
    f, H, std = responses()
    fit = fit_modes(f, nudge(H), std, highest_order=24)
    return {"modes": np.array([[m.frequency_Hz, 1e3 * m.damping_ratio] for m in fit.modes])}


def fitted(nudge):
    """A decaying oscillation, nonlinear in rate and frequency; two of its parameters make up for each other."""
    t = np.linspace(0.0, 4.0, 60)
    noise = 0.05 * np.random.default_rng(2).standard_normal(len(t))
    y = nudge(0.3 + 2.0 * np.exp(-0.4 * t) * np.cos(5.0 * t) + noise)
    mean, precision = np.array([0.0, 1.0, 0.5, 4.6, 0.0]), np.diag([1.0, 0.5, 4.0, 0.25, 1e-6])

    def evaluate(x):
        offset, size, rate, omega, more = x
        e, c, s = np.exp(-rate * t), np.cos(omega * t), np.sin(omega * t)
        model = offset + (size + more) * e * c
        columns = [np.ones_like(t), e * c, -(size + more) * t * e * c, -(size + more) * t * e * s, e * c]
        return (y - model) / 0.05, np.stack(columns, axis=1) / 0.05

    found = minimise(evaluate, nudge(mean), mean=mean, precision=precision, tolerance=1e-10, iterations=60)
    assert found.settled
    return {"fit": found.x, "cost": np.array([found.cost])}


@cache
def predicted_rig():
    o, q = np.linspace(0.0, 2e-5, 60), np.linspace(0.0, 1e-5, 60)
    softening, loss = 3.3e8 * o / (o + 2e-6), 3e9 * q**2 / (q**2 + 2.5e-12)
    law = LayerLawTable(opening_m=o.tolist(), softening=softening.tolist(), slip_m=q.tolist(), loss=loss.tolist())
    rig = STEEL.model_copy(update={"joint": STEEL.joint.model_copy(update={"law": law})})
    return RigResponse(blank_data(rig))


def predicted(nudge):
    """Every response to a force between two folds, and the force that holds a response."""
    f = nudge(np.linspace(25.9, 26.7, 17))
    forced = predicted_rig().forced(f, nudge(np.full(len(f), 2.0)))
    held = predicted_rig().held(f, nudge(np.full(len(f), 20.0)))
    return {
        "forced": forced.acceleration_m_per_s2, "steps": forced.step.astype(float),
        "held": held.force_N, "stable": forced.stable.astype(float),
    }  # fmt: skip


CASES = {
    "steel": lambda nudge: balanced("steel", nudge),
    "duffing": lambda nudge: balanced("duffing", nudge),
    "sliders": lambda nudge: balanced("sliders", nudge),
    "kinks": lambda nudge: balanced("kinks", nudge),
    "modal fit": modal,
    "gauss-newton": fitted,
    "predicted response": predicted,
}


def untouched(values):
    return np.asarray(values)


if __name__ == "__main__":
    answers = {f"{name}: {key}": value for name, case in CASES.items() for key, value in case(untouched).items()}
    np.savez(sys.argv[1], **answers)
