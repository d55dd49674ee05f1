"""Every cause of the contract acts on the bench, under its own name and parameters."""

from __future__ import annotations

import numpy as np
import pytest
from contract_causes import BEYOND_CONTRACT, CONTRACT

from recordings.errors import InputError
from recordings.streams import Excitation
from twin.bench import EFFECTS, BenchSetup, check_effects, draw_case, open_bench, steel_law
from twin.cause_registry import DRAWS
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
RATE = 1024.0


def phasor(values, frequency_Hz):
    t = np.arange(len(values)) / RATE
    basis = np.column_stack([np.cos(2 * np.pi * frequency_Hz * t), np.sin(2 * np.pi * frequency_Hz * t), t**0])
    c = np.linalg.lstsq(basis, values.astype(float), rcond=None)[0]
    return complex(c[0], -c[1])


def record(effects=(), *, frequency_Hz=40.0, volts=1.0, noise=False, seconds=2, **options):
    effects = [Effect(cause=cause, parameters=parameters) for cause, parameters in effects]
    bench = open_bench(RIG, effects=effects, **options, setup=BenchSetup(noise=noise))
    bench.set_output(Excitation(kind="sine", amplitude_V=volts, frequency_Hz=frequency_Hz))
    bench.read(4096)
    return bench.read(int(seconds * RATE))


def test_names_and_parameters_are_the_contracts():
    rng = np.random.default_rng(0)
    assert set(EFFECTS) == set(CONTRACT) == set(DRAWS)
    for cause, names in CONTRACT.items():
        case = draw_case(rng, rig=RIG, causes=[cause])
        assert set(case.effects[0].parameters) - BEYOND_CONTRACT.get(cause, set()) == names


def passage(effects):
    bench = open_bench(RIG, effects=effects, setup=BenchSetup(noise=False))
    bench.set_output(Excitation(kind="sine", amplitude_V=1.6, frequency_Hz=26.3))
    bench.read(5120)
    return bench.read(1024).samples


@pytest.fixture(scope="module")
def plain_passage():
    return passage([])


# Marched among many others; each has a quick test of its own in `tests/twin/causes`.
LONG_TO_MARCH = {"ground-stop", "joint-friction"}


@pytest.mark.parametrize(
    "cause",
    [
        pytest.param(cause, marks=pytest.mark.slow) if cause in LONG_TO_MARCH else cause
        for cause in sorted(set(CONTRACT) - {"unsettled-dwell", "lost-samples"})
    ],
)
def test_every_effect_changes_the_recording(cause, plain_passage):
    case = draw_case(np.random.default_rng(1), rig=RIG, causes=[cause])
    changed = passage(case.effects)
    difference = max(np.abs(plain_passage[c] - changed[c]).max() / np.abs(plain_passage[c]).max() for c in changed)
    assert difference > 1e-4


def test_gain_polarity_and_cross_talk():
    plain = record().samples
    gained = record([("channel-gain", {"channel": "acc1", "factor": 1.05})]).samples
    turned = record([("channel-polarity", {"channel": "acc1"})]).samples
    mixed = record([("cross-talk", {"channel": "acc1", "source": "acc2", "factor": 0.1})]).samples
    np.testing.assert_allclose(gained["acc1"], 1.05 * plain["acc1"], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(turned["acc1"], -plain["acc1"], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(mixed["acc1"], plain["acc1"] + 0.1 * plain["acc2"], rtol=1e-3, atol=2e-3)
    np.testing.assert_array_equal(gained["acc2"], plain["acc2"])


@pytest.mark.parametrize("rate", [1024.0, 12800.0])
def test_delay_turns_the_phase_and_nothing_else(rate):
    global RATE
    delay, frequency = 1.3e-4, 40.0
    plain, late = (
        record(e, frequency_Hz=frequency, sample_rate_Hz=rate, seconds=4 * rate / RATE).samples
        for e in ([], [("channel-delay", {"channel": "acc2", "delay_s": delay})])
    )

    def at(values):
        t = np.arange(len(values)) / rate
        return np.mean(values * np.exp(-2j * np.pi * frequency * t))

    ratio = (at(late["acc2"]) / at(late["acc1"])) / (at(plain["acc2"]) / at(plain["acc1"]))
    assert abs(ratio) == pytest.approx(1.0, abs=1e-3)
    assert -np.angle(ratio) == pytest.approx(2 * np.pi * frequency * delay, rel=0.01)


def test_high_pass_leads_as_its_corner_says():
    plain, leading = (record(e).samples for e in ([], [("ac-coupling", {"channel": "acc2", "corner_Hz": 2.0})]))
    ratio = phasor(leading["acc2"], 40.0) / phasor(plain["acc2"], 40.0)
    assert ratio == pytest.approx(1 / (1 - 2j / 40), rel=1e-3)


def test_mounting_resonance_raises_as_a_second_order_system():
    plain, raised = (
        record(e).samples
        for e in ([], [("mounting-resonance", {"channel": "acc2", "frequency_Hz": 400.0, "damping_ratio": 0.05})])
    )
    ratio = abs(phasor(raised["acc2"], 40.0) / phasor(plain["acc2"], 40.0))
    assert ratio == pytest.approx(1 / (1 - 0.01), rel=2e-3)


def test_clipping_is_not_counted_as_overload_but_the_converters_limit_is():
    clipped = record([("clipping", {"channel": "acc2", "limit": 5.0})], frequency_Hz=26.4, volts=1.0)
    assert np.abs(clipped.samples["acc2"]).max() == pytest.approx(5.0, rel=1e-3)
    assert clipped.overload["acc2"] == 0
    small = RIG.model_copy(
        update={"sensor": [s.model_copy(update={"range": 5.0}) if s.channel == "acc2" else s for s in RIG.sensor]}
    )
    bench = open_bench(small)
    bench.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=26.4))
    bench.read(4096)
    block = bench.read(1024)
    assert block.overload["acc2"] == np.sum(np.abs(block.samples["acc2"]) > 4.999) > 0
    assert np.abs(block.samples["acc2"]).max() <= 5.0


def test_quantisation_leaves_multiples_of_its_step():
    values = record([("quantisation", {"channel": "acc1", "step": 0.25})]).samples["acc1"]
    np.testing.assert_allclose(values / 0.25, np.rint(values / 0.25), atol=1e-4)


def test_hum_adds_a_line():
    bench = open_bench(
        RIG,
        effects=[Effect(cause="mains-hum", parameters={"channel": "acc1", "frequency_Hz": 50.0, "amplitude": 0.7})],
        setup=BenchSetup(noise=False),
    )  # fmt: skip
    assert abs(phasor(bench.read(2048).samples["acc1"][1024:], 50.0)) == pytest.approx(0.7, rel=1e-2)


def test_lost_samples_repeat_the_last_value_for_20_ms():
    values = record([("lost-samples", {"channel": "acc2"})], noise=True, seconds=60).samples
    held = {c: np.convolve(np.diff(values[c]) == 0, np.ones(15), "valid") == 15 for c in ("acc1", "acc2")}
    assert not held["acc1"].any()
    starts = np.count_nonzero(np.diff(held["acc2"].astype(int)) == 1)
    assert 4 < starts < 25


def test_a_fast_clock_makes_every_frequency_look_low():
    values = record([("sample-clock", {"error_ppm": 5000.0})], seconds=8).samples["force"]
    frequency = np.linspace(39.5, 40.2, 141)
    found = frequency[np.argmax([abs(phasor(values, f)) for f in frequency])]
    assert found == pytest.approx(40.0 / 1.005, abs=0.006)


def test_preload_loss_softens_the_joint_as_time_goes_by():
    bench = open_bench(
        RIG, effects=[Effect(cause="preload-loss", parameters={"rate_per_s": 0.01})], setup=BenchSetup(drive="force")
    )
    bench.set_output(Excitation(kind="sine", amplitude_V=0.1, frequency_Hz=60.0))
    first = bench.read(1024).samples["acc2"]
    for _ in range(19):
        last = bench.read(1024).samples["acc2"]
    assert np.abs(np.diff(first)).max() < 1.0
    start, end = (bench.built.modal(t, 51200.0).omega[0] for t in (0.0, 20.0))
    softer = open_bench(
        RIG, effects=[Effect(cause="joint-stiffness", parameters={"normal_factor": 0.8, "shear_factor": 1.0})]
    )
    assert end == pytest.approx(softer.built.modal(0.0, 51200.0).omega[0], rel=1e-4)
    assert end < start
    assert np.isfinite(last).all()


def test_wrong_effects_are_refused_with_what_there_is():
    with pytest.raises(ValueError, match="gremlin: there is no such effect"):
        open_bench(RIG, effects=[Effect(cause="gremlin", parameters={})])
    with pytest.raises(ValueError, match="takes mass, mass_kg, node, part, position_m"):
        open_bench(RIG, effects=[Effect(cause="added-mass", parameters={"mass": 0.1})])
    with pytest.raises(ValueError, match="no channel 'acc9'"):
        open_bench(RIG, effects=[Effect(cause="channel-polarity", parameters={"channel": "acc9"})])


@pytest.mark.parametrize(
    ("rig", "cause", "parameters", "told"),
    [
        ("hung-lap-joint", "temperature-drift", {"rate_per_s": "fast"}, "rate_per_s is a number, not 'fast'"),
        ("hung-lap-joint", "channel-gain", {"channel": 3.0, "factor": 2.0}, "no channel '3'"),
        ("hung-lap-joint", "preload-loss", {"rate_per_s": 1e-6, "joint": "lep"}, "no joint 'lep'; the rig has lap"),
        ("hung-lap-joint", "added-mass", {"part": "upper", "node": 3.0, "mass_kg": 0.1}, "is a beam and has no nodes"),
        ("stiffened-plate", "added-mass", {"part": "plate", "node": 999.0, "mass_kg": 0.1}, "has no node 999"),
        ("stiffened-plate", "added-mass", {"part": "plate", "position_m": 0.1, "mass_kg": 0.1}, "no beam 'plate'"),
        ("stiffened-plate", "sensor-position", {"channel": "acc1", "offset_m": 0.01}, "sits at a node of 'plate'"),
    ],
)
def test_an_effect_of_a_rig_file_is_refused_with_file_place_and_reason(rig, cause, parameters, told):
    wrong = load_rig(rig).model_copy(update={"effect": [Effect(cause=cause, parameters=parameters)]})
    with pytest.raises(InputError) as refused:
        check_effects(wrong, source="my-rig.toml")
    assert str(refused.value).startswith(f"my-rig.toml: effect.0, {cause}: ")
    assert told in str(refused.value)


def test_a_law_that_is_given_softens_a_softer_joint_by_its_share():
    """It would else take off more than a joint of three quarters has, which then runs away."""
    effect = Effect(cause="joint-stiffness", parameters={"normal_factor": 0.75, "shear_factor": 1.0})
    E = RIG.joint.preload["120N"].normal_modulus
    given = open_bench(RIG, effects=[effect], joint_law=steel_law(E), setup=BenchSetup(drive="force")).built
    assert given.laws[0].normal.describing_function(1.0) == pytest.approx(
        0.75 * steel_law(E).normal.describing_function(1.0)
    )
    assert given.plan.joints[0].E + given.laws[0].normal.describing_function(1.0) > 0
