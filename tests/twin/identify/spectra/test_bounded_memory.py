"""A record, a dwell and a search for hum take as much memory for long recordings as for short ones."""

import tracemalloc

import numpy as np
import pytest

from recordings import RunWriter, read_run
from recordings.run import Channel, SampleBlock, Step, StepState
from twin.causes.mains_hum.finding import find_mains_hum
from twin.diagnose.signals import find_sidebands
from twin.identify.spectra.broadband import Binning, bin_response, find_resonances
from twin.identify.spectra.sine_fit import steady_states
from twin.identify.spectra.spectrum import broadband_records

RATE, BLOCK, NAMES = 25600.0, 8192, ("force", "acc1", "acc2")


def recording(path, *, minutes, frequency_Hz):
    """One stretch of noise, or of a sine with noise."""
    channels = [Channel(name=name, quantity="force" if name == "force" else "acceleration", unit="N" if name == "force"
                        else "m/s^2", range=9.0) for name in NAMES]  # fmt: skip
    blocks = round(minutes * 60 * RATE / BLOCK)
    about = {"sweep": "s", "index": 0, "frequency_Hz": frequency_Hz, "target_channel": "force", "target_amplitude": 1.0}
    rng = np.random.default_rng(1)
    with RunWriter(path, info={"source": "measured"}, channels=channels) as writer:
        writer.write_step(Step(time_ns=0, state=StepState.MEASURING, **about))
        for k in range(blocks):
            wave = np.sin(2 * np.pi * frequency_Hz / RATE * (k * BLOCK + np.arange(BLOCK)))
            noise = rng.standard_normal((len(NAMES), BLOCK))
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=k * 320_000_000, first_index=k * BLOCK, sample_rate_Hz=RATE,
                    samples=dict(zip(NAMES, (wave + noise).astype(np.float32), strict=True)),
                )
            )  # fmt: skip
        writer.write_step(Step(time_ns=blocks * 320_000_000, state=StepState.DONE, **about))
    return path


def peak_MB(reduce, path):
    """Of what is allocated beside the opened recording."""
    run = read_run(path)
    tracemalloc.start()
    reduce(run)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def reduce_noise(run):
    (record,) = broadband_records(run)
    resonances, _ = find_resonances(record, force="force", channels=NAMES[1:])
    binning = Binning(
        force="force", channels=NAMES[1:], reference=lambda omega: np.ones((len(omega), 2), complex),
        poles=np.array([-5 + 700j]), resonances_Hz=resonances[:3], band_Hz=np.array([5.0, 1000.0]),
    )  # fmt: skip
    bin_response(record, binning)


def search_and_fit(run):
    steady_states(run)
    find_mains_hum([run])
    find_sidebands([run], NAMES[1:], {})


@pytest.mark.slow
@pytest.mark.parametrize(("reduce", "frequency_Hz", "most_MB"), [(reduce_noise, 0.0, 80), (search_and_fit, 26.2, 90)])
def test_three_times_the_length_takes_little_more(tmp_path, reduce, frequency_Hz, most_MB):
    """By the float64 samples alone it would be 49 MB more for each minute of the three channels."""
    short, long = (
        peak_MB(reduce, recording(tmp_path / f"{minutes}.mcap", minutes=minutes, frequency_Hz=frequency_Hz))
        for minutes in (1, 3)
    )
    assert long < most_MB
    assert long - short < 30
