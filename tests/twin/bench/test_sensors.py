"""What a rig file says of sensors, converter and drift acts as the named effects do, or as its formula says."""

from __future__ import annotations

import numpy as np
import pytest
from beam_rows import axial, deflection, slope

from recordings.streams import Excitation
from twin.bench import BenchSetup, no_law, open_bench
from twin.rigs import Effect, load_rig
from twin.rigs.tables import Acquisition, Drift
from twin.structure import assemble, normal_modes

RIG = load_rig("steel-lap-joint")


def with_sensor(channel, **update):
    sensors = [s.model_copy(update=update) if s.channel == channel else s for s in RIG.sensor]
    return RIG.model_copy(update={"sensor": sensors})


def record(rig, *effects, rate=1024.0, count=4096, frequency_Hz=26.0):
    bench = open_bench(rig, effects=effects, sample_rate_Hz=rate, setup=BenchSetup(noise=False))
    bench.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=frequency_Hz))
    return bench.read(count).samples


@pytest.mark.parametrize(
    ("rig", "cause", "parameters"),
    [
        (
            with_sensor("acc2", mounting_frequency=400.0, mounting_damping=0.05),
            "mounting-resonance", {"channel": "acc2", "frequency_Hz": 400.0, "damping_ratio": 0.05},
        ),
        (RIG.model_copy(update={"acquisition": Acquisition(clock_error_ppm=800.0)}),
         "sample-clock", {"error_ppm": 800.0}),
        (RIG.model_copy(update={"drift": Drift(preload_loss_per_h=3.6)}), "preload-loss", {"rate_per_s": 1e-3}),
        (RIG.model_copy(update={"drift": Drift(temperature_K_per_h=3600.0, stiffness_per_K=-2e-3)}),
         "temperature-drift", {"rate_per_s": 2e-3}),
    ],
    ids=["mounting", "clock", "preload", "temperature"],
)  # fmt: skip
def test_a_line_of_the_rig_file_does_what_the_named_effect_does(rig, cause, parameters):
    found, expected, plain = record(rig), record(RIG, Effect(cause=cause, parameters=parameters)), record(RIG)
    for name in expected:
        np.testing.assert_array_equal(found[name], expected[name])
    assert any(np.any(found[name] != plain[name]) for name in plain)


def test_transverse_sensitivity_shows_the_motion_of_the_surface_along_the_beam():
    """At a resonance the difference is the share of u - (t/2) v' there, over v, in the mode of the full elements."""
    share, moduli = 0.05, RIG.joint.preload["120N"]
    structure = assemble(RIG, layout=RIG.layout(beam_elements=60, layer_elements=6))
    modes = normal_modes(structure.M, structure.stiffness(moduli.normal_modulus, moduli.shear_modulus), 2)
    along = axial(structure, 0.30) - RIG.upper.thickness / 2 * slope(structure, 0.30)
    resonances = modes.omega / (2 * np.pi)
    found = []
    for rig in (RIG, with_sensor("acc1", transverse_sensitivity=share)):
        bench = open_bench(rig, joint_law=no_law(), setup=BenchSetup(drive="force"))
        at = bench.built.locals + bench.built.auxiliaries + [c.name for c in bench.channels].index("acc1")
        found.append(bench.built.rig(0.0, 51200.0).transfer(resonances)[:, at, 0])
    expected = share * (along @ modes.Phi) / (deflection(structure, 0.30) @ modes.Phi)
    np.testing.assert_allclose(found[1] / found[0] - 1, expected, rtol=0.02)


def test_without_its_filter_the_converter_folds_a_tone_back():
    open_converter = RIG.model_copy(update={"acquisition": Acquisition(anti_alias=False)})
    t = np.arange(1024) / 1024.0
    folded = []
    for rig in (RIG, open_converter):
        force = record(rig, frequency_Hz=700.0, count=2048)["force"][1024:].astype(float)
        folded.append(2 * abs(np.mean(force * np.exp(-2j * np.pi * 324.0 * t))))
    direct = record(RIG, rate=4096.0, frequency_Hz=700.0, count=8192)["force"][4096:].astype(float)
    expected = 2 * abs(np.mean(direct * np.exp(-2j * np.pi * 700.0 * np.arange(4096) / 4096.0)))
    assert folded[0] < 1e-3 * expected
    assert folded[1] == pytest.approx(expected, rel=0.02)
