"""A softening that also moves the layer at its harmonics, in steady states by harmonic balance."""

import numpy as np
import pytest
from full_elements import FullElements
from scipy.optimize import least_squares

from studies.nonlinear_sweeps import rig_with_law
from studies.tables import load_study
from twin.bench import BenchSetup, open_bench
from twin.response import HarmonicBalance
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


@pytest.mark.parametrize(
    ("preload", "force"), [("120N", 1.0), ("120N", 1.5), ("120N", 3.0), ("120N", 6.0), ("540N", 5.0)]
)
def test_at_resonance_the_layer_acts_with_the_moduli_of_the_file(preload, force):
    """Of the papers' law, which takes off more than half of E': the moduli that the full elements need are the file's.

    Were the layer's own harmonics left out of its law, the softening would act 2.3 % too strongly at 1.6 mm.
    """
    study = load_study("steel-lap-joint")
    law, elements = study.sweeps.law[preload], FullElements(RIG, preload)
    built = open_bench(rig_with_law(RIG, study.sweeps, preload), preload=preload, setup=BenchSetup(drive="force")).built
    first_Hz = elements.omega[0] / (2 * np.pi)
    branch = HarmonicBalance(built, harmonics=9).branch(first_Hz + 0.3, first_Hz - 0.6, force, step=0.1)
    top = max(branch, key=lambda state: abs(state.channels[2, 1]))
    omega = 2 * np.pi * top.frequency_Hz
    measured = -top.channels[2, 1] / top.inputs[0, 1] / omega**2
    X = abs(top.channels[2, 1]) / elements.omega[0] ** 2
    meant = np.array([np.polynomial.polynomial.polyval(X, c) for c in (law.softening, law.loss)])

    def miss(share):
        ratio = elements.receptance(omega, *(meant * share)) / measured
        return [np.log(ratio).real, np.log(ratio).imag]

    # The solution of all elements is good to some 1e-6, which finite differences must stand out of.
    found = least_squares(miss, [1.0, 1.0], diff_step=1e-3)
    np.testing.assert_allclose(found.fun, 0.0, atol=1e-5)
    np.testing.assert_allclose(found.x, 1.0, atol=2e-3)
