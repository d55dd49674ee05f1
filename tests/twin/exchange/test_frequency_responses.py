"""Frequency responses for sdypy: what its packages find in our export is what was put into the samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff
from pyFRF import FRF
from sdypy import EMA

from recordings import Channel, InputError, Run, RunWriter, SampleBlock, Step, StepState, read_run, sweeps
from recordings.convert import to_sep005
from twin.exchange import frequency_responses, write_universal

RATE_Hz, COUNT = 1024, 1 << 16
FREQUENCY_Hz, DAMPING = np.array([40.0, 110.0, 260.0]), np.array([0.02, 0.01, 0.005])
SHAPES = np.array([[1.0, -0.7, 0.5], [0.6, 0.9, -0.8]])
"""Of two sensors in three modes; the force acts at the first."""
CHANNELS = [
    Channel(name="force", quantity="force", unit="N", position_m=0.1),
    Channel(name="acc1", quantity="acceleration", unit="m/s^2", position_m=0.1),
    Channel(name="acc2", quantity="acceleration", unit="m/s^2", position_m=0.4, direction="-y"),
]
RESOLUTION_Hz = 0.25


def accelerance(frequency_Hz: np.ndarray) -> np.ndarray:
    """The true response, (2, f), in closed form."""
    s = 2j * np.pi * frequency_Hz[:, None]
    omega = 2 * np.pi * FREQUENCY_Hz
    modes = s**2 / (s**2 + 2 * DAMPING * omega * s + omega**2)
    return np.einsum("om,m,fm->of", SHAPES, SHAPES[0], modes)


def write(path: Path, samples: np.ndarray, steps: list[Step]) -> Run:
    names = [channel.name for channel in CHANNELS]
    with RunWriter(path, info={"source": "measured", "rig": "three modes"}, channels=CHANNELS) as writer:
        for step in steps:
            writer.write_step(step)
        for first in range(0, samples.shape[1], 1024):
            part = samples[:, first : first + 1024].astype(np.float32)
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=round(first * 1e9 / RATE_Hz), first_index=first, sample_rate_Hz=RATE_Hz,
                    samples=dict(zip(names, part, strict=True)),
                )
            )  # fmt: skip
    return read_run(path)


def step(time_ns: int, sweep: str, index: int, frequency_Hz: float, state: StepState) -> Step:
    return Step(
        time_ns=time_ns, sweep=sweep, index=index, frequency_Hz=frequency_Hz, target_channel="force",
        target_amplitude=1.0, state=state,
    )  # fmt: skip


@pytest.fixture(scope="module")
def broadband(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A periodic random force, its exact steady response, and a little noise."""
    rng = np.random.default_rng(3)
    force = rng.standard_normal(COUNT)
    response = np.fft.irfft(accelerance(np.fft.rfftfreq(COUNT, 1 / RATE_Hz)) * np.fft.rfft(force), COUNT)
    response[1] *= -1  # mounted the other way round
    response += 1e-3 * rng.standard_normal(response.shape)
    steps = [step(0, "random", 0, 0.0, StepState.MEASURING)]
    return write(tmp_path_factory.mktemp("exchange") / "broadband.mcap", np.vstack([force, response]), steps)


def model(**arguments: object) -> EMA.Model:
    """Of the band with the three modes."""
    return EMA.Model(lower=10, upper=400, pol_order_high=30, **arguments)


def poles(found: EMA.Model) -> tuple[np.ndarray, np.ndarray]:
    found.get_poles(show_progress=False)
    found.select_closest_poles(list(FREQUENCY_Hz))
    return np.array(found.nat_freq), np.array(found.nat_xi)


def assert_true_modes(found: EMA.Model) -> None:
    """A Hann window of 4 s widens what is narrow: the damping is the window's too, the frequency is not."""
    frequency_Hz, damping = poles(found)
    np.testing.assert_allclose(frequency_Hz, FREQUENCY_Hz, rtol=1e-3)
    np.testing.assert_allclose(damping, DAMPING, rtol=0.25)


def test_ema_takes_our_frequency_responses(broadband: Run) -> None:
    (r,) = frequency_responses(broadband, resolution_Hz=RESOLUTION_Hz)
    found = model(frf=r.frf, freq=r.frequency_Hz, frf_form=r.frf_form, driving_point=0)
    assert_true_modes(found)
    found.get_constants(f_lower=10, f_upper=390)
    ratio = found.A[1] / found.A[0]
    np.testing.assert_allclose(ratio.real, -SHAPES[1] / SHAPES[0], rtol=0.05)  # the sensor's own direction


def test_ema_reads_our_universal_file(broadband: Run, tmp_path: Path) -> None:
    found = frequency_responses(broadband, resolution_Hz=RESOLUTION_Hz)
    write_universal(found, tmp_path / "frf.uff", run=broadband)
    read = model()
    read.read_uff(str(tmp_path / "frf.uff"))
    assert read.frf_form == "accelerance"
    assert_true_modes(read)


def test_pyfrf_takes_our_dictionaries_and_finds_the_same(broadband: Run) -> None:
    """The stretch as SEP-0005 dictionaries, as they are, into pyFRF; what that estimates into sdypy-EMA."""
    stretch = next(sweeps(broadband)).stretches[0]
    force, *responses = to_sep005(broadband, start_ns=stretch.start_ns, stop_ns=stretch.stop_ns)
    segment = round(RATE_Hz / RESOLUTION_Hz)
    (ours,) = frequency_responses(broadband, resolution_Hz=RESOLUTION_Hz)
    band = (ours.frequency_Hz > 10) & (ours.frequency_Hz < 400)
    estimates = []
    for row, response in enumerate(responses):
        theirs = FRF(
            sampling_freq=None, exc=force, resp=response, window="hann", nperseg=segment, fft_len=segment,
            frf_estimator="H1",
        )  # fmt: skip
        np.testing.assert_allclose(theirs.get_f_axis(), ours.frequency_Hz)
        estimate = np.squeeze(theirs.get_FRF("default", "accelerance"))
        # Equal but for the segments' means, which only ours takes off.
        np.testing.assert_allclose(estimate[band], ours.frf[row][band], rtol=2e-4)
        np.testing.assert_allclose(np.squeeze(theirs.get_coherence())[band], ours.coherence[row][band], rtol=2e-4)
        estimates.append(estimate[1:])  # it gives NaN at 0 Hz
    assert_true_modes(model(frf=estimates, freq=theirs.get_f_axis()[1:], frf_form="accelerance"))


def test_universal_file_keeps_every_value_unit_and_direction(broadband: Run, tmp_path: Path) -> None:
    (r,) = frequency_responses(broadband, resolution_Hz=RESOLUTION_Hz)
    write_universal([r], tmp_path / "frf.uff", run=broadband)
    sets = pyuff.UFF(str(tmp_path / "frf.uff")).read_sets()
    assert [each["func_type"] for each in sets] == [4, 6, 4, 6]
    for row, frf, coherence in ((0, sets[0], sets[1]), (1, sets[2], sets[3])):
        np.testing.assert_array_equal(frf["data"], r.frf[row])
        np.testing.assert_array_equal(coherence["data"], r.coherence[row])
        np.testing.assert_allclose(frf["x"], r.frequency_Hz, atol=1e-9)
        assert (frf["ordinate_axis_units_lab"], frf["orddenom_axis_units_lab"]) == ("m/s^2", "N")
        assert (frf["ordinate_spec_data_type"], frf["orddenom_spec_data_type"]) == (12, 13)
        assert (frf["rsp_node"], frf["rsp_dir"], frf["ref_node"], frf["ref_dir"]) == (2 + row, (2, -2)[row], 1, 2)


def test_a_stepped_sine_gives_the_response_at_its_steps(tmp_path: Path) -> None:
    """Steps of a down sweep, each an exact sine: the fundamental's ratio, sorted upward, unevenly spaced."""
    frequency_Hz = np.array([41.0, 40.2, 39.0])
    time = np.arange(RATE_Hz) / RATE_Hz
    turn = np.exp(2j * np.pi * frequency_Hz[:, None] * time)
    H = accelerance(frequency_Hz) * [[1], [-1]]
    samples = np.concatenate([turn[None], H[:, :, None] * turn[None]]).real.reshape(3, -1)
    steps = [step(i * 10**9, "1N-down", i, f, StepState.MEASURING) for i, f in enumerate(frequency_Hz)]
    run = write(tmp_path / "sine.mcap", samples, steps)
    (r,) = frequency_responses(run)
    assert (r.sweep, r.coherence) == ("1N-down", None)
    np.testing.assert_array_equal(r.frequency_Hz, frequency_Hz[::-1])
    np.testing.assert_allclose(r.frf, H[:, ::-1], rtol=1e-5)
    write_universal([r], tmp_path / "frf.uff", run=run)
    first = pyuff.UFF(str(tmp_path / "frf.uff")).read_sets()[0]
    np.testing.assert_allclose(first["x"], r.frequency_Hz)
    np.testing.assert_array_equal(first["data"], r.frf[0])


def test_a_run_without_force_or_sweep_is_refused(broadband: Run, tmp_path: Path) -> None:
    without = {name: channel for name, channel in broadband.channels.items() if name != "force"}
    with pytest.raises(InputError, match="one force is needed, there are none"):
        frequency_responses(Run(**{**broadband.__dict__, "channels": without}))
    with pytest.raises(InputError, match="no sweep over frequency"):
        frequency_responses(Run(**{**broadband.__dict__, "steps": ()}))
    (tmp_path / "frf.uff").write_text("precious")
    with pytest.raises(InputError, match="exists already"):
        write_universal([], tmp_path / "frf.uff", run=broadband)


def test_averages_are_what_the_scatter_of_h1_says():
    """Noise on the response: the variance of H1 is (1 - g2) / (2 n g2) of its square, of each part."""
    from twin.identify.spectra.spectrum import BroadbandRecord, h1

    rng = np.random.default_rng(8)
    force, noise = rng.standard_normal((2, 400_000))
    samples = {"force": force, "acc": 2.0 * force + noise}
    record = BroadbandRecord(run="a", sweep="noise", time_s=0.0, sample_rate_Hz=1000.0, samples=samples)
    found = h1(record, force="force", resolution_Hz=0.1)
    g2 = 4 / 5
    expected = np.sqrt((1 - g2) / (2 * found.averages * g2)) * 2.0
    inside = slice(10, -10)
    assert np.std(found.H["acc"][inside].real) == pytest.approx(expected, rel=0.05)
    assert np.std(found.H["acc"][inside].imag) == pytest.approx(expected, rel=0.05)
