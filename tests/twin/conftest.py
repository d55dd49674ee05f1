"""A campaign on the bench, recorded once for all tests that identify, and steady states without a recording."""

import numpy as np
import pytest

from recordings import RunWriter
from twin.bench import open_bench
from twin.identify.sine_fit import SteadyState
from twin.procedures import DirectAcquisition, Random, SteppedSine, run_procedure
from twin.procedures.tables import Measure
from twin.rigs import load_rig


@pytest.fixture(scope="session")
def make_state():
    """Makes a steady state of 1 N with nothing measured, but for the fields that are given."""

    def make(**fields):
        nothing = {
            "run": "sweeps.mcap", "sweep": "1N-up", "index": 0, "position": 0, "frequency_Hz": 26.0,
            "target_channel": "force", "target_amplitude": 1.0, "time_s": 0.0, "amplitude": {}, "variance": {},
            "drift": {}, "drift_std": {}, "lost": 0, "overloaded": 0, "duration_s": 1.0,
        }  # fmt: skip
        return SteadyState(**{**nothing, **fields})

    return make


@pytest.fixture(scope="session")
def true_rig():
    """The steel rig as it is, which is not as its file says: moduli off by some per cent, damping by more."""
    nominal = load_rig("steel-lap-joint")
    moduli = nominal.joint.preload["120N"].model_copy(update={"normal_modulus": 3.7e8, "shear_modulus": 8.0e7})
    joint = nominal.joint.model_copy(update={"preload": {"120N": moduli}})
    damping = nominal.damping.model_copy(update={"modal_ratio": [0.0020, 0.0022, 0.0018, 0.0033]})
    return nominal.model_copy(update={"joint": joint, "damping": damping, "measured": {}})


@pytest.fixture(scope="session")
def campaign(tmp_path_factory, true_rig):
    """Recordings of a broadband run, sweeps at 1.5, 3 and 6 N, and a held-out sweep at 4.5 N."""
    folder = tmp_path_factory.mktemp("campaign")
    # Denser about the resonance, which is where the levels differ.
    frequencies = [25.6, 25.9, *np.round(np.arange(26.1, 26.8, 0.06), 3).tolist(), 27.0]
    measure = Measure(seconds=1.0)
    procedures = {
        "random": Random(band=(5.0, 1000.0), duration=30.0, rms=0.5),
        "sweeps": SteppedSine(frequencies=frequencies, amplitudes=[1.5, 3.0, 6.0], measure=measure),
        "heldout": SteppedSine(frequencies=frequencies, amplitudes=[4.5], measure=measure),
    }
    for seed, (name, procedure) in enumerate(procedures.items()):
        acquisition = DirectAcquisition(open_bench(true_rig, seed=seed))
        info = {"source": "simulated", "rig": true_rig.name, "preload_N": "120", "stored": procedure.store}
        with RunWriter(folder / f"{name}.mcap", info=info, channels=list(acquisition.channels)) as writer:
            assert run_procedure(procedure, acquisition, writer).state == "done"
    return folder
