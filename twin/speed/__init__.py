"""Benchmarks: what is promised of speed, measured on this machine beside something else that gives the same answer."""

from collections.abc import Callable

from recordings.benchmark import Measured, MissingRivalError
from twin.speed.duffing import duffing
from twin.speed.equivalent_linear import equivalent_linear_sweep
from twin.speed.gauss_newton import gauss_newton_step
from twin.speed.harmonic_balance import balance, ten_sliders
from twin.speed.integrators import against_solve_ivp
from twin.speed.start import start
from twin.speed.streaming import streaming
from twin.speed.three_modes import gauss_newton_three_modes

BENCHMARKS: dict[str, Callable[[], Measured]] = {
    "streaming": streaming,
    "streaming-against-solve-ivp": against_solve_ivp,
    "harmonic-balance": balance,
    "harmonic-balance-ten-sliders": ten_sliders,
    "duffing": duffing,
    "equivalent-linear-sweep": equivalent_linear_sweep,
    "gauss-newton-step": gauss_newton_step,
    "gauss-newton-three-modes": gauss_newton_three_modes,
    "start": start,
}
"""In the order they are measured."""
