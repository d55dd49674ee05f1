"""Amplitude and phase control on a resonator whose answer is known."""

import numpy as np
import pytest
from resonator import ListSink, Resonator

from twin.procedures import DirectAcquisition, SteppedSine, load_procedure, run_procedure
from twin.procedures.tables import Controller, Limits, Phase, Settle

GRID = [26.0, 26.2, 26.35, 26.45, 26.5, 26.55, 26.65, 26.8, 27.0]


def run(source, **fields):
    sink = ListSink()
    procedure = SteppedSine(**{"amplitudes": [1.5], **fields})
    return run_procedure(procedure, DirectAcquisition(source), sink), sink


@pytest.mark.parametrize("back_emf_ratio", [0.1, 4.0])
def test_force_is_held_through_the_resonance(back_emf_ratio):
    """The second rig's force falls to a fifth at resonance: a plain ratio controller overshoots there by five."""
    rig = Resonator(back_emf_ratio=back_emf_ratio)
    result, sink = run(rig, frequencies=GRID)
    assert result.state == "done"
    assert max(abs(step.amplitude_error) for step in result.steps) < 0.003
    for step in result.steps:
        exact = -((2 * np.pi * step.frequency_Hz) ** 2) * rig.receptance(step.frequency_Hz)
        assert step.phasors["acc"] / step.phasors["force"] == pytest.approx(exact, rel=1e-3)
    assert not sink.events


def test_a_sweep_of_41_steps_stays_within_the_rig_time_it_was_promised():
    procedure = load_procedure("steel-sweeps").model_copy(update={"amplitudes": [1.5], "limits": Limits()})
    result = run_procedure(procedure, DirectAcquisition(Resonator()), ListSink())
    assert len(result.steps) == 41
    assert result.duration_s < 41 * 17.5
    assert all(step.settled for step in result.steps)


def test_response_is_held_near_and_away_from_resonance():
    result, _ = run(
        Resonator(),
        frequencies=[26.0, 26.4, 26.5, 26.6, 27.0],
        control="response",
        target_channel="acc",
        amplitudes=[5],
    )
    assert [step.sweep for step in result.steps] == ["5m/s2-up"] * 5
    assert max(abs(step.amplitude_error) for step in result.steps) < 0.005


def test_open_loop_voltage_is_what_was_asked_for():
    result, sink = run(Resonator(), frequencies=[26.0], control="voltage", amplitudes=[0.1])
    assert result.steps[0].voltage_V == 0.1
    assert sink.steps[0].target_channel == "voltage"
    assert abs(result.steps[0].phasors["force"]) == pytest.approx(0.4, rel=0.01)  # 4 N/V, hardly any drop off resonance


def duffing_receptance_roots(rig, force_N, frequency_Hz):
    """Stable and unstable amplitudes of the one-harmonic Duffing response, m."""
    w = 2 * np.pi * frequency_Hz
    a, b = 0.75 * rig.cubic, rig.spring - rig.mass_kg * w**2
    damping = 2 * rig.damping_ratio * np.sqrt(rig.spring * rig.mass_kg) * w
    squares = np.roots([a**2, 2 * a * b, b**2 + damping**2, -(force_N**2)])
    return np.sqrt(np.sort(squares[(abs(squares.imag) < 1e-9 * abs(squares)) & (squares.real > 0)].real))


def test_phase_resonance_follows_the_backbone():
    rig = Resonator(cubic=-1e8)
    levels = [0.2, 1.0, 2.0, 4.0]
    result, _ = run(
        rig,
        frequencies=[26.4],
        amplitudes=levels,
        control="phase-resonance",
        phase=Phase(channel="acc"),
        direction="both",
    )
    assert [step.sweep for step in result.steps] == ["phase-resonance-26.4Hz-up"] * 4 + [
        "phase-resonance-26.4Hz-down"
    ] * 4
    for step in result.steps:
        amplitude = abs(step.phasors["acc"]) / (2 * np.pi * step.frequency_Hz) ** 2
        backbone = rig.frequency_Hz * np.sqrt(1 + 0.75 * rig.cubic * amplitude**2 / rig.spring)
        assert step.frequency_Hz == pytest.approx(backbone, abs=0.005)
        assert abs(step.amplitude_error) < 0.005
    assert result.steps[3].frequency_Hz < result.steps[0].frequency_Hz - 0.2  # there was a backbone to follow


def test_a_stepped_sine_jumps_where_the_folds_are():
    rig, force = Resonator(cubic=-1e8, back_emf_ratio=0.01), 4.0
    grid = [round(26.1 + 0.02 * i, 2) for i in range(20)]
    fine = np.arange(26.0, 26.6, 0.0005)
    folded = fine[[len(duffing_receptance_roots(rig, force, f)) == 3 for f in fine]]
    result, _ = run(rig, frequencies=grid, amplitudes=[force], direction="both")

    def jump(sweep):
        steps = [step for step in result.steps if step.sweep == sweep]
        sizes = np.array([abs(step.phasors["acc"]) for step in steps])
        at = int(np.argmax(np.abs(np.diff(sizes))))
        return sorted((steps[at].frequency_Hz, steps[at + 1].frequency_Hz))

    assert folded[-1] - folded[0] > 0.1  # the grid can tell the folds apart
    for sweep, fold in (("4N-up", folded[-1]), ("4N-down", folded[0])):
        low, high = jump(sweep)
        assert low - 0.02 <= fold <= high + 0.02


def test_an_adaptive_grid_is_fine_where_the_response_changes():
    grid = {"kind": "adaptive", "start": 25.0, "stop": 28.0, "step": 0.3, "smallest": 0.01, "change": 0.3}
    result, _ = run(Resonator(), grid=grid)
    frequencies = np.array([step.frequency_Hz for step in result.steps])
    steps = np.diff(frequencies)
    assert frequencies[0] == 25.0
    assert frequencies[-1] == 28.0
    at_peak = steps[np.argmin(abs(frequencies[:-1] - 26.5))]
    assert at_peak < 0.03
    assert steps.max() > 0.15
    responses = np.array([step.phasors["acc"] for step in result.steps])
    change = abs(np.diff(responses)) / np.maximum(abs(responses[1:]), abs(responses[:-1]))
    assert change.max() < 0.45


def test_a_ladder_of_amplitudes_at_one_frequency():
    result, sink = run(Resonator(), frequencies=[26.5], order="amplitude", amplitudes=[2.0, 0.5, 1.0], direction="both")
    assert [step.target_amplitude for step in result.steps] == [0.5, 1.0, 2.0, 2.0, 1.0, 0.5]
    assert [step.sweep for step in sink.steps if step.state.name == "DONE"] == ["26.5Hz-up", "26.5Hz-down"]


def test_a_force_that_cannot_be_reached_is_reported():
    result, sink = run(
        Resonator(), frequencies=[26.0, 26.5], amplitudes=[5.0], limits=Limits(voltage=1.0), controller=Controller()
    )
    assert result.state == "done"
    assert [event.kind for event in sink.events] == ["not-held", "not-held"]
    assert "limit of 1 V" in sink.events[0].detail
    assert result.steps[1].amplitude < result.steps[0].amplitude < 4.1


def test_a_wait_that_ends_at_its_maximum_is_reported():
    result, sink = run(Resonator(), frequencies=[26.4, 26.5], settle=Settle(tolerance=1e-4, maximum=6.0))
    assert result.steps[1].settled is False
    assert "unsettled" in [event.kind for event in sink.events]
