"""``twin speed``: the benchmark ratios on this machine, each with its promise and the error at which it holds."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import click

from twin.commands.output import console, json_option, print_json

__all__ = ["command"]

RATE_Hz = 25600.0
CHUNK = 1 << 14
SECONDS = 0.2
"""Of rig time in the comparison of integrators."""
FREQUENCY_Hz, VOLTS = 26.3, 1.6


@click.command("speed")
@json_option
def command(as_json: bool) -> None:
    """Measure the benchmark ratios on this machine.  One thread; compilation is not counted."""
    results = {
        "streaming": streaming(),
        "streaming-against-solve-ivp": against_solve_ivp(),
        "harmonic-balance": balance(),
        "equivalent-linear-sweep": equivalent_linear_sweep(),
        "receptances": receptances(),
    }
    if as_json:
        print_json(results)
        return
    for name, row in results.items():
        promise = f"(promised {row['promise']:g})" if row["promise"] else ""
        console.print(f"{name}: {row['ratio']:.0f} times {row['against']} {promise}, error {row['error']:.1g}")


def least_seconds(work: Callable[[], Any], repeats: int) -> float:
    """Shortest of several runs, the first of which is not counted."""
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def streaming() -> dict[str, Any]:
    """Four channels with noise and converter, over real time; the error is that of one step a sample."""
    from recordings.streams import Excitation
    from twin.bench import open_bench
    from twin.rigs import load_rig

    bench = open_bench(load_rig("steel-lap-joint"), sample_rate_Hz=RATE_Hz, monitors=("voltage",))
    bench.set_output(Excitation(kind="sine", amplitude_V=VOLTS, frequency_Hz=FREQUENCY_Hz))
    seconds = least_seconds(lambda: bench.read(CHUNK), 12)
    ratio = CHUNK / RATE_Hz / seconds
    return {"ratio": ratio, "promise": 150, "against": "real time at 25.6 kHz", "error": marched()[1], "threads": 1}


def against_solve_ivp() -> dict[str, Any]:
    """Marching against scipy's RK45 on the same reduced rig, at a tolerance that leaves it the larger error."""
    ours, error = marched()
    exact, _ = integrated(1e-9)
    tip, seconds = integrated(1e-5)
    theirs = float(abs(tip - exact).max() / abs(exact).max())
    return {
        "ratio": seconds / ours,
        "promise": 500,
        "against": "scipy.integrate.solve_ivp RK45",
        "error": error,
        "error_of_the_other": theirs,
        "threads": 1,
    }


def equivalent_linear_sweep() -> dict[str, Any]:
    """A sweep whose layer is softer at every step, against the full matrices solved at every step, banded."""
    import numpy as np
    from scipy.linalg import solve_banded
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    model, omega, base, dE = _softening_sweep()
    s, port = model.structure, model.ports.outputs.start
    K = s.stiffness(0.0, 0.0)
    order = reverse_cuthill_mckee(csr_array(s.M + K + base.E * (s.KE + s.KG)), symmetric_mode=True)
    parts = [part[np.ix_(order, order)] for part in (K, s.KE, s.KG, s.M)]
    rows, columns = np.nonzero(sum(abs(part) for part in parts))
    width = int(np.max(abs(rows - columns)))
    banded = [np.zeros((2 * width + 1, len(order))) for _ in parts]
    for band, part in zip(banded, parts, strict=True):
        band[width + rows - columns, columns] = part[rows, columns]
    load, read = (model.ports.rows[row][order] for row in (model.ports.drive, port))

    def full() -> Any:
        out = []
        for w, more in zip(omega, dE, strict=True):
            E, G = base.E * (1 + 1j * base.loss_E) + more, base.G * (1 + 1j * base.loss_G)
            band = banded[0] + E * banded[1] + G * banded[2] - w**2 * banded[3]
            out.append(read @ solve_banded((width, width), band, load, check_finite=False))
        return np.array(out)

    def ours() -> Any:
        return model.receptance(omega, base, dE=dE, inner=False)[:, port, model.ports.drive]

    exact = full()
    return {
        "ratio": least_seconds(full, 3) / least_seconds(ours, 20),
        "promise": 40,
        "against": "the banded full model",
        "error": float(np.max(abs(ours() - exact)) / np.max(abs(exact))),
        "threads": 1,
    }


def receptances() -> dict[str, Any]:
    """All receptances that sensitivities need, compiled, against the plain numpy twin."""
    import numpy as np

    from twin.identify.softened import softened_receptance_numpy

    model, omega, base, dE = _softening_sweep()
    basis = model.basis.with_damping(base.zeta, base.detuning)
    S = model.soft_stiffness(omega, base, dE, 0.0)

    def plain() -> Any:
        return softened_receptance_numpy(basis, model.ports.rows, omega, S)

    def ours() -> Any:
        return model.receptance(omega, base, dE=dE)

    exact = plain()
    return {
        "ratio": least_seconds(plain, 5) / least_seconds(ours, 20),
        "promise": None,
        "against": "plain numpy",
        "error": float(np.max(abs(ours() - exact)) / np.max(abs(exact))),
        "threads": 1,
    }


def _softening_sweep() -> tuple[Any, Any, Any, Any]:
    """The steel rig's model, 400 drive frequencies, base parameters, and a layer that loses up to a third of its E'.

    Damped in the joint alone: modal damping would fill the full matrices.
    """
    from dataclasses import replace

    import numpy as np

    from twin.identify.linear_model import Output, believed_parameters, build_linear_model
    from twin.rigs import load_rig

    rig = load_rig("steel-lap-joint")
    model = build_linear_model(rig, [Output("acc2", "acceleration", rig.length)])
    base = replace(believed_parameters(rig), loss_E=0.02, loss_G=0.05, zeta=np.full(5, 1e-12))
    omega = 2 * np.pi * np.linspace(20.0, 32.0, 400)
    return model, omega, base, -np.linspace(0.0, base.E / 3, 400)


def balance() -> dict[str, Any]:
    """Harmonic balance compiled against its plain numpy twin, one point of the steel rig with nine harmonics."""
    import numpy as np

    from twin.bench import open_bench
    from twin.response import HarmonicBalance
    from twin.rigs import load_rig

    built = open_bench(load_rig("steel-lap-joint"), drive="force").built
    fast, slow = (HarmonicBalance(built, harmonics=9, kernel=kernel) for kernel in ("numba", "numpy"))
    quick, plain = (least_seconds(partial(s.solve, 26.6, 1.0), 3) for s in (fast, slow))
    a, b = (s.solve(26.6, 1.0).channels for s in (fast, slow))
    error = float(np.abs(a - b).max() / np.abs(b).max())
    return {"ratio": plain / quick, "promise": None, "against": "its numpy twin", "error": error, "threads": 1}


@cache
def hyperelastic_rig() -> tuple[Any, Any, float]:
    """The shaken rig with a memoryless joint, which any integrator can march: linear part, law, scale of its force."""
    from twin.bench import JointLaw, default_law, open_bench
    from twin.rigs import load_rig

    rig = load_rig("steel-lap-joint")
    law = default_law(rig.joint.preload["120N"].normal_modulus).normal
    built = open_bench(rig, joint_law=JointLaw(law)).built
    return built.rig(0.0, RATE_Hz), law, built.elements_[0].scale


@cache
def marched() -> tuple[float, float]:
    """Seconds for :data:`SECONDS` of the rig at one step a sample, and the error of the joint's opening."""
    import numpy as np

    from twin.bench.linear import to_poles
    from twin.bench.marching import LANES, coefficients, march

    rig, law, scale = hyperelastic_rig()
    c = coefficients(to_poles(rig), 1.0 / RATE_Hz)
    width = len(c.decay) + -len(c.decay) % LANES

    def parts(values: Any) -> Any:
        pad = [(0, 0)] * (values.ndim - 1) + [(0, width - values.shape[-1])]
        return np.ascontiguousarray(np.concatenate([np.pad(values.real, pad), np.pad(values.imag, pad)], axis=-1))

    arrays = [parts(c.decay), parts(c.Gamma.T), parts(np.vstack([c.C[:1], c.C[:1]]).conj())]
    D = np.ascontiguousarray(np.vstack([c.D[:1], c.D[:1]]))
    count = round(SECONDS * RATE_Hz)
    voltage = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * np.arange(count) / RATE_Hz)
    element = np.array([law.kind]), np.array([0]), np.array([-1]), np.array([scale]), law.parameters[None]
    out = np.empty((count, 1))

    compiled: Any = march

    def work() -> None:
        memory = np.zeros((1, 1)), np.zeros(2 * width), np.zeros(1), np.zeros(2)
        compiled(1.0 / RATE_Hz, *arrays, D, 1, 0, *element, *memory, voltage, out)

    seconds = least_seconds(work, 20)
    exact, _ = integrated(1e-9)
    return seconds, float(np.abs(out[:, 0] - exact).max() / np.abs(exact).max())


@cache
def integrated(rtol: float) -> tuple[Any, float]:
    """The joint's opening at the same instants by RK45, and the seconds it took."""
    import numpy as np
    from scipy.integrate import solve_ivp

    rig, law, scale = hyperelastic_rig()
    A, b_V, b_f = rig.A, rig.B[:, 0], rig.B[:, 1]
    c, d_V, d_f = rig.C[0], rig.D[0, 0], rig.D[0, 1]
    k, e0, spring = law.parameters

    def opening(p: float) -> tuple[float, float]:
        """Opening and force that agree through the residual flexibility, o = p + d_f f(o)."""
        o = p
        for _ in range(20):
            q = 1.0 / (1.0 + (o / e0) ** 2)
            force = scale * (k * q**0.5 + spring) * o
            r = o - p - d_f * force
            if abs(r) <= 1e-13 * abs(o):
                break
            o -= r / (1.0 - d_f * scale * (k * q**1.5 + spring))
        return o, force

    def slope(t: float, x: Any) -> Any:
        volts = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * t)
        _, force = opening(float(c @ x) + d_V * volts)
        return A @ x + b_V * volts + b_f * force

    time_s = np.arange(round(SECONDS * RATE_Hz)) / RATE_Hz
    start = time.perf_counter()
    x = solve_ivp(slope, (0.0, time_s[-1]), np.zeros(len(A)), t_eval=time_s, rtol=rtol, atol=1e-3 * rtol * e0).y
    seconds = time.perf_counter() - start
    volts = VOLTS * np.sin(2 * np.pi * FREQUENCY_Hz * time_s)
    return np.array([opening(p)[0] for p in c @ x + d_V * volts]), seconds
