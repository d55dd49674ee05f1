"""Detours of the frequency: the plan against the envelope's equation, the gain on a resonator."""

import numpy as np
import pytest
from resonator import ListSink, Resonator
from scipy.integrate import solve_ivp

from twin.procedures import DirectAcquisition, SteppedSine, run_procedure
from twin.procedures.steps.brake import plan_detour, window_gain
from twin.procedures.tables import Settle

TAU_S = 2.6


@pytest.mark.parametrize("beat_Hz", [-1.1, -0.3, 0.2, 0.7])
@pytest.mark.parametrize("direction", [0.0, 0.8, 2.0, 4.0])
def test_a_detour_leaves_what_it_promises(beat_Hz, direction):
    rate = -1 / TAU_S + 2j * np.pi * beat_Hz
    steady, start = 1.0 + 0.0j, 0.2 * np.exp(1j * direction)
    durations_s = [0.25, 0.5, 0.75, 1.0]
    # not every direction can be reached at once: within half a beat one comes that can
    for wait_s in np.arange(0.0, 0.5 / abs(beat_Hz), 0.1):
        transient = start * np.exp(rate * wait_s)
        detour = plan_detour(rate=rate, transient=transient, steady=steady, durations_s=durations_s)
        if detour is not None:
            break
    assert detour is not None
    w = 2 * np.pi * detour.shift_Hz

    def envelope(_, z):  # z' = (s - i w) z + kF with kF = -s z1, in the frame of the force's phase
        return (rate - 1j * w) * z - rate * steady

    end = solve_ivp(envelope, (0, detour.duration_s), [steady + transient], rtol=1e-10, atol=1e-12).y[0, -1]
    left = abs(end - steady) / (abs(transient) * np.exp(-detour.duration_s / TAU_S))
    assert left == pytest.approx(detour.left, abs=1e-6)
    assert left < 0.4


def test_next_to_the_resonance_there_are_no_detours():
    assert plan_detour(rate=-1 / TAU_S + 0.2j, transient=0.1, steady=1.0, durations_s=[0.5]) is None


def test_a_windows_mean_is_what_the_gain_says():
    rate, length_s = -1 / TAU_S + 2j * np.pi * 0.9, 0.378
    t = np.linspace(-length_s / 2, length_s / 2, 20001)
    assert window_gain(rate, length_s) == pytest.approx(np.trapezoid(np.exp(rate * t), t) / length_s, rel=1e-6)


def test_detours_save_a_quarter_of_the_wait_and_cost_no_accuracy():
    grid = {"start": 25.5, "stop": 27.3, "step": 0.1}
    waits, errors = {}, {}
    for detours in (False, True):
        rig = Resonator()
        procedure = SteppedSine(grid=grid, amplitudes=[1.5], settle=Settle(detours=detours))
        result = run_procedure(procedure, DirectAcquisition(rig), ListSink())
        waits[detours] = sum(step.settle_s for step in result.steps)
        frequency = np.array([step.frequency_Hz for step in result.steps])
        found = np.array([step.phasors["acc"] / step.phasors["force"] for step in result.steps])
        errors[detours] = abs(found / (-((2 * np.pi * frequency) ** 2) * rig.receptance(frequency)) - 1).max()
    assert waits[True] < 0.75 * waits[False]
    assert max(errors.values()) < 6e-4
