"""What rounding may decide: nothing.  The same answers with inputs changed in their last bits, and on any machine.

No frequency of these cases lies within HAIR_Hz of a fold.  A fold moves with its inputs by about as much as these, so
only within some 1e-13 Hz of one could the last bit decide on which side a frequency lies; and an answer at a distance
d from a fold moves as the root of d, by 1e-15 f / (2 d) of the width of the fold, which a hair keeps below TOLERANCE.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from solver_cases import CASES, balance, untouched

DRAWS, LAST_BIT = 200, 1e-15
TOLERANCE = 1e-9
"""Of an answer over its largest value; that of harmonic balance itself."""
OTHER_MACHINE = 1e-5
"""The rigs themselves differ between machines: their lowest natural frequencies by some 1e-10, for the highest of the
same matrices are 1e4 times as high; and near a fold an answer follows them with a slope of some thousands."""
HAIR_Hz = 1e-4
HERE = Path(__file__).parent


def cores():
    """Kernels of OpenBLAS that this processor can run."""
    flags = Path("/proc/cpuinfo").read_text().split() if Path("/proc/cpuinfo").exists() else []
    able = {"Prescott": "pni", "Haswell": "avx2", "Zen": "avx2", "SkylakeX": "avx512vl"}
    return [core for core, flag in able.items() if flag in flags]


def assert_alike(found, expected, tolerance):
    assert found.keys() == expected.keys()
    for key, values in expected.items():
        assert found[key].shape == values.shape, key
        error = np.max(np.abs(found[key] - values))
        assert error <= tolerance * np.max(np.abs(values)), f"{key}: {error:.1e}"


@pytest.mark.parametrize("name", ["steel", "duffing", "sliders", "kinks"])
def test_no_frequency_lies_within_a_hair_of_a_fold(name):
    one, frequencies, levels = balance(name)
    for level in levels:
        passed = np.array([point.frequency_Hz for point in one.branch(frequencies[0], frequencies[-1], level)])
        turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(passed))))
        for fold in passed[turns]:
            assert np.min(np.abs(frequencies - fold)) > HAIR_Hz


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_last_bits_of_the_inputs_do_not_matter(name):
    expected, rng = CASES[name](untouched), np.random.default_rng(7)

    def nudge(values):
        values = np.asarray(values)
        return values * (1.0 + LAST_BIT * rng.uniform(-1.0, 1.0, values.shape))

    for _ in range(DRAWS):
        assert_alike(CASES[name](nudge), expected, TOLERANCE)


@pytest.mark.slow
def test_the_machine_does_not_matter(tmp_path):
    """Other kernels of the linear algebra, and compiled for any processor; one after the other, each a process."""
    machines = [{}, *({"OPENBLAS_CORETYPE": core} for core in cores()), {"NUMBA_CPU_NAME": "generic"}]
    if cores():
        machines.append({"OPENBLAS_CORETYPE": cores()[0], "NUMBA_CPU_NAME": "generic"})
    answers = []
    for number, machine in enumerate(machines):
        out = tmp_path / f"{number}.npz"
        command = [sys.executable, str(HERE / "solver_cases.py"), str(out)]
        subprocess.run(command, env={**os.environ, **machine}, check=True, timeout=900)
        with np.load(out) as file:
            answers.append(dict(file))
    for other in answers[1:]:
        assert_alike(other, answers[0], OTHER_MACHINE)
