"""Benchmarks: what is promised of speed, measured on this machine beside something else that gives the same answer."""

from collections.abc import Callable

from benchmarks import wires
from benchmarks.duffing import duffing
from benchmarks.gauss_newton import gauss_newton_step
from benchmarks.measured import Measured
from benchmarks.start import start
from benchmarks.streaming import streaming
from benchmarks.three_modes import gauss_newton_three_modes

BENCHMARKS: dict[str, Callable[[], Measured]] = {
    "streaming": streaming,
    "duffing": duffing,
    "gauss-newton-step": gauss_newton_step,
    "gauss-newton-three-modes": gauss_newton_three_modes,
    "start": start,
    **wires.BENCHMARKS,
}
"""In the order they are measured."""
