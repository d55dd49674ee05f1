"""A campaign on the bench, recorded once for all tests that identify, and steady states without a recording."""

import pytest
from short_campaign import record_campaign

from twin.identify.spectra.sine_fit import SteadyState
from twin.rigs import load_rig


@pytest.fixture(scope="session")
def make_state():
    """Makes a steady state of 1 N with nothing measured, but for the fields that are given."""

    def make(**fields):
        nothing = {
            "run": "sweeps.mcap", "sweep": "1N-up", "index": 0, "frequency_Hz": 26.0,
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
    return record_campaign(tmp_path_factory.mktemp("campaign"), true_rig)
