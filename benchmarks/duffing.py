"""Harmonic balance on a Duffing oscillator beside mousai, a harmonic balance of the package index without continuation.

    x'' + 0.2 x' + x + 0.1 x^3 = 0.3 sin(w t)

mousai collocates in time and solves by scipy's Newton-Krylov; both start each frequency from the last one's solution.
"""

import importlib
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured import Measured, MissingRivalError, timed_in_turns
from twin.bench.build import Built
from twin.bench.linear import LinearRig, Poles, to_poles
from twin.bench.marching import Elements
from twin.joint import Cubic
from twin.response import HarmonicBalance

HARMONICS, SAMPLES = 7, 128
DAMPING, CUBIC, FORCE = 0.2, 0.1, 0.3
OMEGA = np.linspace(0.4, 1.6, 25)
"""rad/s."""


class _Oscillator:
    """What harmonic balance asks of a rig: one mass, driven by a force, on a cubic spring of its own."""

    locals, auxiliaries = 1, 0

    def poles(self, time_s: float, internal_rate_Hz: float) -> Poles:
        A = np.array([[0.0, 1.0], [-1.0, -DAMPING]])
        B = np.array([[0.0, 0.0], [1.0, -1.0]])
        C = np.array([[1.0, 0.0], [1.0, 0.0]])
        return to_poles(LinearRig(A, B, C, np.zeros((2, 2))))

    def elements(self) -> Elements:
        law = Cubic(CUBIC)
        first, none = np.array([0]), np.array([-1])
        return Elements(np.array([law.kind]), first, none, np.ones(1), law.parameters[None], np.zeros((1, 1)))


def duffing() -> Measured:
    """A point of the response, seven harmonics.

    Raises
    ------
    MissingRivalError
        If mousai is not installed.
    """
    try:
        mousai = importlib.import_module("mousai")
    except ImportError as error:
        raise MissingRivalError("mousai is not installed: pip install 'virtual-test-rig[bench]'") from error
    balance = HarmonicBalance(cast(Built, _Oscillator()), harmonics=HARMONICS, samples=SAMPLES)

    def ours() -> NDArray[Any]:
        found = balance.sweep([float(w) / (2 * np.pi) for w in OMEGA], FORCE)
        return np.array([abs(point.channels[0, 1]) for point in found])

    def acceleration(x: NDArray[Any], v: NDArray[Any], parameters: dict[str, Any]) -> NDArray[Any]:
        drive = FORCE * np.sin(parameters["omega"] * parameters["cur_time"])
        return np.array([-x - CUBIC * x**3 - DAMPING * v + drive])

    def theirs() -> NDArray[Any]:
        x, sizes = np.zeros((1, 2 * HARMONICS + 1)), []
        for w in OMEGA:
            _, x, _, amplitude, _ = mousai.hb_time(
                lambda x, v, p: acceleration(x, v, p).reshape(1, 1),
                x0=x, omega=float(w), num_harmonics=HARMONICS, f_tol=1e-9,
            )  # fmt: skip
            sizes.append(amplitude[0])
        return np.array(sizes)

    mine, other = timed_in_turns(ours, theirs, tries=3)
    found, expected = ours(), theirs()
    points = len(OMEGA)
    return Measured(
        ratio=other / mine, promise=None, against=f"mousai {mousai.__version__}",
        error=float(np.max(np.abs(found - expected)) / expected.max()),
        more={"ms_a_point": 1e3 * mine / points, "ms_a_point_of_the_other": 1e3 * other / points},
    )  # fmt: skip
