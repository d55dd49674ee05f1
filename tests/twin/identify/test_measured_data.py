"""From samples to evidence: what is kept, what is set aside and said, what is refused, whatever clock a device has."""

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection

from recordings import InputError
from recordings.run import Channel, DeviceSamples, Run, Step, StepState
from twin.identify import gather_data
from twin.identify.linear.linear_model import nominal_parameters
from twin.rigs import load_rig
from twin.structure import normal_modes

STEEL = load_rig("steel-lap-joint")
NAMES = ("force", "acc1", "acc2")
FREQUENCIES_Hz = (25.8, 26.3, 26.6, 27.0)
RATE = 2048.0


def run_of(samples, steps, *, offset_s=0.0, **info):
    """A run in which each channel has a device of its own: name -> (values, rate); accelerations begin late."""
    channels, devices = {}, {}
    for name, (values, rate) in samples.items():
        begin = 0 if name == "force" else round(offset_s * 1e9)
        quantity = "force" if name == "force" else "acceleration"
        channels[name] = Channel(name=name, quantity=quantity, unit="N", device=name)
        devices[name] = DeviceSamples(
            device=name, sample_rate_Hz=rate, values={name: np.asarray(values, np.float32)},
            block_start=np.array([0]), block_time_ns=np.array([begin]), overload={},
        )  # fmt: skip
    return Run(path="r", info=info, channels=channels, devices=devices, steps=tuple(steps), events=())


def step(time_s, index, frequency_Hz, state=StepState.MEASURING):
    return Step(
        time_ns=round(time_s * 1e9), sweep="s", index=index, frequency_Hz=frequency_Hz, target_channel="force",
        target_amplitude=1.0, state=state,
    )  # fmt: skip


@pytest.fixture(scope="module")
def swept(steel_dense):
    """Four steps of a second each of the nominal rig; in the third an old transient still dies away."""
    t = np.arange(int(4 * RATE)) / RATE
    omega = 2 * np.pi * np.array(FREQUENCIES_Hz)
    H = steel_dense.accelerance(omega, nominal_parameters(STEEL))
    rng, samples = np.random.default_rng(3), {}
    for name, response in zip(NAMES, (np.ones(4), H[:, 0], H[:, 1]), strict=True):
        x = np.concatenate([(response[i] * np.exp(1j * omega[i] * t[: int(RATE)])).real for i in range(4)])
        if name != "force":
            since = np.clip(t - 2.0, 0, 1)
            tail = 0.2 * abs(response[2]) * np.exp(-1.5 * since) * np.cos(2 * np.pi * 26.4 * since)
            x = x + np.where((t >= 2) & (t < 3), tail, 0.0)
        samples[name] = (x + 1e-4 * rng.standard_normal(len(t)), RATE)
    steps = [step(i, i, f) for i, f in enumerate(FREQUENCIES_Hz)] + [step(4.0, 4, 0.0, StepState.DONE)]
    return run_of(samples, steps), H


def test_steady_steps_are_the_rigs_responses_and_amplitudes(swept):
    run, H = swept
    evidence = gather_data([run], STEEL)
    steps = evidence.steps
    assert [state.index for state in steps.states] == [0, 1, 3]
    kept = [0, 1, 3]
    np.testing.assert_allclose(steps.omega, 2 * np.pi * np.array(FREQUENCIES_Hz)[kept])
    np.testing.assert_allclose(steps.response[:, :, 0] / steps.force[:, :1], H[kept], rtol=1e-3)
    assert evidence.channels == ("acc1", "acc2")
    assert evidence.channels[evidence.reference] == "acc2"
    expected = np.abs(H[kept, 1]) / steps.omega**2
    np.testing.assert_allclose(steps.amplitude_m, expected, rtol=1e-3)
    assert evidence.origin_s == 0.0
    assert replace(evidence, begun_s=-60.0).origin_s == -60.0
    np.testing.assert_allclose(steps.time_s, [0.5, 1.5, 3.5], atol=1e-6)


def test_a_step_that_had_not_settled_is_set_aside_and_told(swept):
    evidence = gather_data([swept[0]], STEEL)
    (state,) = evidence.unsettled
    assert (state.index, state.sweep) == (2, "s")
    assert abs(state.drift["acc2"]) > 0.05


@pytest.mark.parametrize("clock_error", [0.0, 3e-6])
def test_what_still_grows_is_told_apart_from_a_clock_that_runs_fast(clock_error):
    """The clock turns the force, too.  Each step grows by less than would set it aside."""
    rng, t = np.random.default_rng(4), np.arange(int(RATE)) / RATE
    rates = 1e-3 * np.exp(1j * np.array([0.2, 1.7, 3.0, 4.6]))
    samples = {name: (1e-4 * rng.standard_normal(4 * len(t)), RATE) for name in NAMES}
    for i, (f, rate) in enumerate(zip(FREQUENCIES_Hz, rates, strict=True)):
        for name in NAMES:
            grown = 1 + (0 if name == "force" else rate) * (t - 0.5)
            turning = np.exp(2j * np.pi * f * (1 + clock_error) * (t + i))
            samples[name][0][i * len(t) : (i + 1) * len(t)] += (grown * turning).real
    steps = [step(i, i, f) for i, f in enumerate(FREQUENCIES_Hz)] + [step(4.0, 4, 0.0, StepState.DONE)]
    found = gather_data([run_of(samples, steps)], STEEL).steps
    assert np.all((found.growth_std > 5e-6) & (found.growth_std < 5e-5))
    assert np.max(np.abs(found.growth - rates) / found.growth_std) < 5
    np.testing.assert_array_equal(found.complex_omega, found.omega - 1j * found.growth)


def test_a_sensor_mounted_the_other_way_round_turns_the_model(swept):
    run, H = swept
    turned = {"acc1": replace(run.channels["acc1"], direction="-y")}
    evidence = gather_data([replace(run, channels={**run.channels, **turned})], STEEL)
    assert [output.sign for output in evidence.outputs] == [-1.0, 1.0]
    base, omega = nominal_parameters(STEEL), 2 * np.pi * np.array(FREQUENCIES_Hz)
    predicted = evidence.model.response(evidence.model.receptance(omega, base), omega)
    np.testing.assert_allclose(predicted, H * [-1.0, 1.0], rtol=1e-5)


def turned(run, *names):
    """The same motion and force, recorded by sensors mounted the other way round."""
    return replace(
        run,
        channels={n: replace(c, direction="-y") if n in names else c for n, c in run.channels.items()},
        devices={
            n: replace(d, values={n: -d.values[n]}) if n in names else d for n, d in run.devices.items()
        },
    )  # fmt: skip


@pytest.mark.parametrize("names", [("force",), ("acc2",), ("force", "acc1", "acc2")], ids=" ".join)
@pytest.mark.parametrize("runs", ["one", "two, of which one is turned"])
def test_what_was_measured_does_not_depend_on_how_a_sensor_was_mounted(swept, names, runs):
    run, _ = swept
    before = [run] if runs == "one" else [run, run]
    expected = gather_data(before, STEEL)
    found = gather_data([*before[1:], turned(run, *names)], STEEL)
    sign = [output.sign for output in found.outputs]
    np.testing.assert_allclose(found.steps.force, expected.steps.force)
    np.testing.assert_allclose(found.steps.response * np.array(sign)[:, None], expected.steps.response, rtol=1e-6)


def test_devices_of_other_rates_are_fitted_each_at_its_own(swept):
    run, H = swept
    slow = replace(
        run.devices["acc1"], sample_rate_Hz=RATE / 4, values={"acc1": run.devices["acc1"].values["acc1"][::4]}
    )
    steps = gather_data([replace(run, devices={**run.devices, "acc1": slow})], STEEL).steps
    np.testing.assert_allclose(steps.response[:, :, 0] / steps.force[:, :1], H[[0, 1, 3]], rtol=1e-3)


@pytest.mark.parametrize(("info", "asked", "preload"), [
    ({}, None, "120N"), ({"preload_N": "540"}, None, "540N"), ({"preload_N": "77"}, None, "120N"),
    ({"preload_N": "540"}, "120N", "120N"),
])  # fmt: skip
def test_the_preload_is_the_recordings_unless_another_is_asked_for(swept, info, asked, preload):
    evidence = gather_data([replace(swept[0], info=info)], STEEL, preload=asked)
    assert evidence.preload == preload
    assert evidence.model.reference_E == STEEL.joint.preload[preload].normal_modulus


def test_channels_that_not_all_runs_have_are_left_out(swept):
    run, _ = swept
    fewer = replace(run, channels={n: c for n, c in run.channels.items() if n != "acc1"})
    assert gather_data([run, fewer], STEEL).channels == ("acc2",)


@pytest.mark.parametrize(("missing", "place"), [(("force",), "channel force"), (("acc1", "acc2"), "channels")])
def test_recordings_without_the_rigs_channels_are_refused(swept, missing, place):
    run, _ = swept
    poor = replace(run, channels={n: c for n, c in run.channels.items() if n not in missing})
    with pytest.raises(InputError, match=place):
        gather_data([poor], STEEL)


def test_recordings_that_measured_nothing_are_refused(swept):
    idle = replace(swept[0], steps=tuple(replace(s, state=StepState.SETTLING) for s in swept[0].steps))
    with pytest.raises(InputError, match="no measured step"):
        gather_data([idle], STEEL)


@pytest.fixture(scope="module")
def shaken(steel_model):
    """Makes ten seconds of random excitation: with an offset of the accelerations' clock, at rates of their own."""
    s, fine, period = steel_model.structure, 10240.0, 30.0
    base = nominal_parameters(STEEL)
    modes = normal_modes(s.M, s.stiffness(base.E, base.G))
    zeta = np.concatenate([base.zeta[:4], np.full(len(modes.omega) - 4, base.zeta[4])])
    residues = np.array([deflection(s, 0.30), deflection(s, 0.42)]) @ modes.Phi * (deflection(s, 0.05) @ modes.Phi)
    rng = np.random.default_rng(5)
    count = int(period * fine)
    f = np.fft.rfftfreq(count, 1 / fine)
    inside = (f > 5) & (f < 600)
    w = 2 * np.pi * f[inside, None]
    spectra = np.zeros((3, len(f)), complex)
    spectra[0, inside] = rng.standard_normal(inside.sum()) + 1j * rng.standard_normal(inside.sum())
    H = -(w**2) * ((1 / (modes.omega**2 - w**2 + 2j * zeta * modes.omega * w)) @ residues.T)
    spectra[1:, inside] = H.T * spectra[0, inside]
    spectra *= 0.5 / np.std(np.fft.irfft(spectra[0], count))
    steps = [step(0.5, 0, 0.0), step(10.5, 1, 0.0, StepState.DONE)]

    def make(*, offset_s=0.0, rates=(2048.0, 2048.0, 2048.0)):
        samples = {}
        for name, X, rate in zip(NAMES, spectra, rates, strict=True):
            late = 0.0 if name == "force" else offset_s
            x = np.fft.irfft(X * np.exp(2j * np.pi * f * late), count)[:: round(fine / rate)][: int(11 * rate)]
            samples[name] = (x + 1e-4 * rng.standard_normal(len(x)), rate)
        return run_of(samples, steps, offset_s=offset_s)

    return make


def delays_s(evidence):
    """Of the binned responses against the model's, from their phases above 250 Hz."""
    (data,) = evidence.broadband
    R = evidence.model.receptance(data.omega, nominal_parameters(STEEL))
    phase = np.log(data.H / evidence.model.response(R, data.omega)).imag
    high = data.frequency_Hz > 250
    return np.median(-phase[high] / data.omega[high, None], axis=0)


def test_random_excitation_shows_the_rig_without_delay(shaken):
    evidence = gather_data([shaken()], STEEL)
    assert np.max(np.abs(delays_s(evidence))) < 1e-6
    assert evidence.linear.base.zeta[0] == pytest.approx(STEEL.damping.modal_ratio[0], rel=0.05)


def test_devices_that_sample_at_other_instants_are_not_delayed(shaken):
    """By half a sample, which the time stamps say: 244 microseconds, far more than any cause of a delay."""
    assert np.max(np.abs(delays_s(gather_data([shaken(offset_s=0.5 / 2048)], STEEL)))) < 1e-5


def test_a_further_channel_at_its_own_slow_rate_does_no_harm(shaken):
    run = shaken()
    slow = run_of({"oil": (np.full(120, 20.0), 10.0)}, ())
    more = replace(run, channels={**run.channels, **slow.channels}, devices={**run.devices, **slow.devices})
    assert len(gather_data([more], STEEL).broadband) == 1


def test_a_channel_that_lost_every_sample_is_refused_by_name(shaken):
    run = shaken()
    dead = replace(run.devices["acc1"], values={"acc1": np.full(len(run.devices["acc1"]), np.nan, np.float32)})
    with pytest.raises(InputError, match="acc1"):
        gather_data([replace(run, devices={**run.devices, "acc1": dead})], STEEL)
