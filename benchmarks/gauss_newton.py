"""One Gauss-Newton step of the joint's law: analytic sensitivities against finite differences on the full model."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.equivalent_linear import banded_model, softening_sweep
from benchmarks.measured import Measured, timed_in_turns

Array = NDArray[Any]

SWEEPS, STEPS = 4, 60
CHANGE = 1e-4
"""Of each parameter in the finite differences, relative: less drowns in the rounding of the full matrices."""


def gauss_newton_step() -> Measured:
    """Four sweeps of 60 steps, ten parameters: E', G', their loss, and cubics of softening and loss over amplitude."""
    sweep = softening_sweep(STEPS)
    model, base = sweep.model, sweep.base
    response = banded_model(model)
    omega = np.tile(sweep.omega, SWEEPS)
    shape = 1.0 / (1.0 + np.linspace(-2.0, 2.0, STEPS) ** 2)
    amplitude = np.concatenate([level * shape for level in (0.25, 0.5, 0.75, 1.0)])
    powers = amplitude[:, None] ** np.arange(1, 4)
    start = np.concatenate([base.E, base.G, [0.2, 0.5], np.repeat(-0.1 * base.E, 3), np.repeat(0.05 * base.G, 3)])
    into_E = np.column_stack([np.ones(len(omega)), powers])
    port, drive = model.ports.outputs.start, model.ports.drive

    def moduli(p: Array) -> tuple[Array, Array]:
        return p[0] * (1 + 1j * p[2]) + powers @ p[4:7], p[1] * (1 + 1j * p[3]) + 1j * (powers @ p[7:10])

    def by_moduli(by_E: Array, by_G: Array) -> Array:
        """Sensitivities to the parameters from those to complex E' and G' at each step."""
        return np.column_stack([
            (1 + 1j * start[2]) * by_E, (1 + 1j * start[3]) * by_G, 1j * start[0] * by_E, 1j * start[1] * by_G,
            by_E[:, None] * into_E[:, 1:], 1j * by_G[:, None] * into_E[:, 1:],
        ])  # fmt: skip

    def analytic() -> tuple[Array, Array]:
        E, G = moduli(start)
        dE, dG = E - base.complex_E, G - base.complex_G
        R = model.receptance(omega, base, dE=dE[:, None], dG=dG[:, None], modal=False)
        out, into = R[:, port], R[:, :, drive]
        by_E, by_G = (-np.sum(out[:, s] * into[:, s], axis=1) for (s,) in (model.ports.normal, model.ports.shear))
        return R[:, port, drive], by_moduli(by_E, by_G)

    def differences() -> tuple[Array, Array]:
        at = response(omega, *moduli(start))
        columns = []
        for i, value in enumerate(start):
            moved = start.copy()
            moved[i] = value * (1 + CHANGE)
            columns.append((response(omega, *moduli(moved)) - at) / (moved[i] - value))
        return at, np.column_stack(columns)

    true = start * (1 + 0.01 * np.linspace(-1.0, 1.0, len(start)))
    measured = response(omega, *moduli(true))

    def step(sensitivities: Callable[[], tuple[Array, Array]]) -> Array:
        at, by = sensitivities()
        J, r = (by / at[:, None]) * start, np.log(measured / at)
        return np.linalg.lstsq(np.vstack([J.real, J.imag]), np.concatenate([r.real, r.imag]), rcond=None)[0]

    mine, other = timed_in_turns(lambda: step(analytic), lambda: step(differences), tries=3)
    (at, ours), (_, theirs) = analytic(), differences()
    scale = np.abs(theirs * start / at[:, None]).max()
    error = float(np.abs((ours - theirs) * start / at[:, None]).max() / scale)
    return Measured(
        ratio=other / mine, promise=200, against="finite differences on the banded full model", error=error,
        more={"ms": 1e3 * mine, "steps": SWEEPS * STEPS, "parameters": len(start)},
    )  # fmt: skip
