"""Steps are told to be changing by what the noise of response and force cannot do, and seldom otherwise."""

import pytest

from recordings import read_run
from twin.diagnose.signals import find_unsettled
from twin.identify.measured_data import gather_data
from twin.identify.spectra.settled import still_changing
from twin.identify.spectra.sine_fit import steady_states
from twin.procedures import SteppedSine
from twin.procedures.tables import Measure
from twin.rehearsal import NominalRig, open_twin, rehearse
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
NEAR_Hz = [round(26.2 + 0.02 * i, 2) for i in range(20)]


@pytest.mark.parametrize("measure_s", [1.0, 4.0])
def test_no_settled_step_at_low_force_is_thrown_away(tmp_path, measure_s):
    """The cell's noise is up to 3 % of the force there, the accelerometers' a hundredth of their signal's."""
    procedure = SteppedSine(
        frequencies=NEAR_Hz, amplitudes=[0.01, 0.05], sample_rate=1024.0, measure=Measure(seconds=measure_s)
    )
    rehearse(
        procedure,
        open_twin(STEEL, procedure, preload="120N", seed=5, source="steel"),
        tmp_path / "low.mcap",
        nominal=NominalRig.of(STEEL, preload="120N"),
    )
    run = read_run(tmp_path / "low.mcap")
    states = steady_states(run)
    assert max(abs(state.change("acc2", force="force")) / state.drift_std["acc2"] for state in states) > 8
    assert gather_data([run], STEEL).unsettled == ()
    assert find_unsettled(states, force="force") == []


def test_a_change_counts_beside_the_noise_of_both_channels_at_however_many_steps(make_state):
    def changing(count, **values):
        return sum(still_changing([make_state(**values)] * count, ["acc"], force="force"))

    turned = {"acc": 0.01j, "force": 0.0}
    assert changing(1, drift=turned, drift_std={"acc": 1e-3, "force": 1e-3}) == 1
    assert changing(1, drift=turned, drift_std={"acc": 1e-4, "force": 5e-3}) == 0
    grown = {"acc": 0.01, "force": 0.0}  # the noise of the force turns its phase, but not the response's size
    assert changing(1, drift=grown, drift_std={"acc": 1e-3, "force": 5e-3}) == 1
    scarcely = {"acc": 0.005, "force": 0.0}
    assert changing(1, drift=scarcely, drift_std={"acc": 1e-3, "force": 1e-3}) == 1
    assert changing(1000, drift=scarcely, drift_std={"acc": 1e-3, "force": 1e-3}) == 0


def test_a_change_too_small_to_matter_is_none(make_state):
    small = make_state(drift={"acc": 1e-3, "force": 0.0}, drift_std={"acc": 1e-6, "force": 1e-6})
    assert still_changing([small], ["acc"], force="force") == [False]
