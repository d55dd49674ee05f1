"""Broadband records of a two-mode system in discrete time, whose exact response is its filter's, with known noise."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import signal

from recordings.run import Channel, DeviceSamples, Run, Step, StepState
from twin.identify.spectra import spectrum
from twin.identify.spectra.broadband import Binning, bin_response, find_resonances, hidden_resonances
from twin.identify.spectra.spectrum import BroadbandRecord, broadband_records, h1

RATE, SECONDS, BAND = 1024.0, 30.0, (5.0, 300.0)
BAND_PASS = signal.butter(6, np.array(BAND) / (RATE / 2), "bandpass", output="sos")
CHANNELS = ("acc1", "acc2")
FORCE_NOISE, NOISE = 2e-3, {"acc1": 4e-3, "acc2": 8e-3}
"""Noise densities, N and m/s2 per root hertz."""


@dataclass(frozen=True)
class TwoModes:
    """Two accelerations under a force that is held between samples."""

    frequency_Hz: tuple[float, float] = (26.4, 157.0)
    zeta: tuple[float, float] = (0.004, 0.003)

    @property
    def poles(self):
        """Complex poles of one half plane, rad/s."""
        w, z = 2 * np.pi * np.array(self.frequency_Hz), np.array(self.zeta)
        return -z * w + 1j * w * np.sqrt(1 - z**2)

    @property
    def filters(self):
        """Numerators of both outputs and their denominator."""
        A, C, D = np.zeros((4, 4)), np.zeros((2, 4)), np.zeros((2, 1))
        shapes = np.array([[1.2, 0.9], [2.0, -1.1]])
        for r, (f, z) in enumerate(zip(self.frequency_Hz, self.zeta, strict=True)):
            w = 2 * np.pi * f
            A[2 * r : 2 * r + 2, 2 * r : 2 * r + 2] = [[0, 1], [-(w**2), -2 * z * w]]
            C[:, 2 * r : 2 * r + 2] = shapes[:, r, None] * A[2 * r + 1, 2 * r : 2 * r + 2]
            D[:, 0] += shapes[:, r]
        discrete = signal.cont2discrete((A, np.array([[0.0], [1.0], [0.0], [1.0]]), C, D), 1 / RATE)
        b, a = signal.ss2tf(*discrete[:4])
        return b, a

    def response(self, omega):
        """Exact frequency response (f, o)."""
        b, a = self.filters
        return np.stack([signal.freqz(row, a, np.asarray(omega) / RATE)[1] for row in b], axis=1)

    def record(self, rng, *, noisy=True, extra=None, parts=1):
        """Half a minute, or so many of them, cut out of a longer run."""
        count, before = parts * int(SECONDS * RATE), int(20 * RATE)
        force = signal.sosfilt(BAND_PASS, rng.standard_normal(count + before))
        b, a = self.filters
        samples = {"force": force, **{c: signal.lfilter(row, a, force) for c, row in zip(CHANNELS, b, strict=True)}}
        samples = {name: x[before:].copy() for name, x in samples.items()}
        if extra is not None:
            for name in CHANNELS:
                samples[name] += extra(name, count)
        if noisy:
            for name, density in {"force": FORCE_NOISE, **NOISE}.items():
                samples[name] += density * np.sqrt(RATE / 2) * rng.standard_normal(count)
        return BroadbandRecord(run="r", sweep="s", time_s=1.0, sample_rate_Hz=RATE, samples=samples)


TRUE = TwoModes()
NEAR = TwoModes((26.4 * (1 + 1e-4), 157 * (1 - 1e-4)), (0.00408, 0.00294))
"""A reference as good as a fit to the same record gives."""


def binned(record, reference=NEAR, band=(8.0, 250.0)):
    binning = Binning(
        force="force", channels=CHANNELS, reference=reference.response, poles=reference.poles,
        resonances_Hz=np.array([*TRUE.frequency_Hz, *reference.frequency_Hz]), band_Hz=np.array(band),
    )  # fmt: skip
    return bin_response(record, binning)


def pulls(data):
    """Errors of the logarithm, whitened by the stated covariance, (b, o)."""
    error = np.log(data.H / TRUE.response(data.omega))
    return np.linalg.solve(np.linalg.cholesky(data.relative_covariance), error[:, :, None])[:, :, 0]


@pytest.fixture(scope="module")
def repeated():
    rng = np.random.default_rng(21)
    return [binned(TRUE.record(rng)) for _ in range(12)]


def test_a_record_cut_out_of_a_running_response_has_no_leakage():
    """Of plain ratios of spectral lines half are wrong by more than five parts in a hundred."""
    record = TRUE.record(np.random.default_rng(1), noisy=False)
    f, U = record.lines("force", (8.0, 250.0))
    truth = TRUE.response(2 * np.pi * f)
    plain = [np.abs(record.lines(c, (8.0, 250.0))[1] / U / truth[:, o] - 1) for o, c in enumerate(CHANNELS)]
    assert np.median(plain) > 0.05
    data = binned(record, reference=TRUE)
    error = np.abs(data.H / TRUE.response(data.omega) - 1)
    assert np.median(error) < 2e-4
    assert np.max(error) < 0.02


def test_the_stated_covariance_covers_the_error(repeated):
    sizes = np.concatenate([np.abs(pulls(data)).ravel() ** 2 for data in repeated])
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.15)
    assert 0.03 < np.mean(sizes > 3) < 0.09  # exp(-3) = 0.05
    assert np.mean(sizes > 9) < 2e-3  # exp(-9) = 1e-4


def test_errors_that_channels_share_are_stated_as_shared(repeated):
    """Noise of the force moves all channels alike: the ratio of two channels is far better known than either."""
    log_ratio, stated, single = [], [], []
    for data in repeated:
        error = np.log(data.H / TRUE.response(data.omega))
        C = data.relative_covariance
        log_ratio.append(np.abs(error[:, 0] - error[:, 1]) ** 2)
        stated.append((C[:, 0, 0] + C[:, 1, 1] - C[:, 0, 1] - C[:, 1, 0]).real)
        single.append(np.minimum(C[:, 0, 0], C[:, 1, 1]).real)
    ratio, stated, single = (np.concatenate(x) for x in (log_ratio, stated, single))
    together = stated < 0.1 * single
    assert np.sum(together) > 100
    assert np.mean(ratio[together] / stated[together]) == pytest.approx(1.0, abs=0.25)


def test_noise_densities_are_found(repeated):
    for name, density in {"force": FORCE_NOISE, **NOISE}.items():
        found = np.array([data.noise_density[name] for data in repeated])
        assert np.mean(found) == pytest.approx(density, rel=0.05)
        assert np.max(np.abs(found / density - 1)) < 0.2


def test_distortion_shows_where_it_is_and_widens_the_covariance():
    """Scatter of ten times each channel's noise in a band about the second resonance."""
    rng = np.random.default_rng(5)
    near = signal.butter(4, np.array([150.0, 164.0]) / (RATE / 2), "bandpass", output="sos")

    def scatter(name, count):
        return signal.sosfilt(near, 10 * NOISE[name] * np.sqrt(RATE / 2) * rng.standard_normal(count))

    inside = []
    for _ in range(6):
        data = binned(TRUE.record(rng, extra=scatter))
        at, away = np.abs(data.frequency_Hz - 157) < 5, np.abs(data.frequency_Hz - 157) > 20
        inside.append(np.abs(pulls(data)[at]) ** 2)
        assert np.median(data.distortion[at]) > 20
        assert np.median(data.distortion[away]) == pytest.approx(1.0, abs=0.15)
        assert data.noise_density["acc2"] == pytest.approx(NOISE["acc2"], rel=0.2)
    # One factor serves all channels, so that a direction which alone scatters is understated by their number.
    assert 0.8 < np.mean(np.concatenate(inside)) < 2.0


def test_a_kink_too_slight_for_a_peak_shows_by_the_scatter_of_its_bins():
    """A light resonator far from the structure's own resonances, where bins are wide."""
    plain = TRUE.record(np.random.default_rng(11))
    kinked = TRUE.record(np.random.default_rng(11))
    b, a = signal.iirpeak(90.0, 40.0, fs=RATE)
    for name in CHANNELS:
        kinked.samples[name][:] += 0.3 * signal.lfilter(b, a, kinked.samples[name])
    assert 90.0 not in np.round(find_resonances(kinked, force="force", channels=CHANNELS)[0])
    (found,) = hidden_resonances(binned(kinked))
    assert found == pytest.approx(90.0, abs=2.0)
    assert len(hidden_resonances(binned(plain))) == 0


def test_hopeless_bins_are_left_out_and_depth_is_one_on_a_peak():
    weak = TRUE.record(np.random.default_rng(6))
    weak.samples["acc1"][:] += 3.0 * np.random.default_rng(7).standard_normal(len(weak.samples["acc1"]))
    data, all_of_them = binned(weak), binned(TRUE.record(np.random.default_rng(6)))
    assert 0 < len(data.frequency_Hz) < len(all_of_them.frequency_Hz)
    assert np.all(np.einsum("boo->bo", data.relative_covariance).real < 0.3**2)
    level = np.abs(TRUE.response(all_of_them.omega))
    assert np.all(all_of_them.depth >= 1)
    for o in range(2):
        assert all_of_them.depth[np.argmax(level[:, o]), o] == pytest.approx(1.0)
        assert np.max(all_of_them.depth[:, o]) > 5


def test_resonances_and_band_are_found():
    frequency, band = find_resonances(TRUE.record(np.random.default_rng(8)), force="force", channels=CHANNELS)
    # The resolution of H1 is a quarter of a hertz; beside the excited band there is nothing but noise to peak.
    np.testing.assert_allclose(frequency[frequency > BAND[0]], TRUE.frequency_Hz, atol=0.26)
    for edge in band:
        around = edge + np.linspace(-1, 1, 61)
        power = np.mean(np.abs(signal.sosfreqz(BAND_PASS, around, fs=RATE)[1]) ** 2)
        assert 0.01 < power < 0.04  # a fiftieth, by 61 lines that each scatter by their own size


def test_a_band_that_is_a_twentieth_of_the_spectrum_is_found():
    """A level taken from all lines would be that of the noise, and the line at rest would count as excited."""
    rng = np.random.default_rng(12)
    narrow = signal.butter(6, np.array([20.0, 45.0]) / (RATE / 2), "bandpass", output="sos")
    record = TRUE.record(rng)
    record.samples["force"][:] = signal.sosfilt(narrow, rng.standard_normal(len(record.samples["force"])))
    record.samples["force"][:] += FORCE_NOISE * rng.standard_normal(len(record.samples["force"]))
    _, band = find_resonances(record, force="force", channels=CHANNELS)
    power = np.abs(signal.sosfreqz(narrow, band, fs=RATE)[1]) ** 2
    assert np.all((power > 0.005) & (power < 0.08))  # a fiftieth, by 61 lines across a steep edge


def test_a_peak_that_has_most_of_the_force_leaves_the_band_as_it_is():
    """A shaker without control drives a structure so at some resonance; all else is a thousandth of it."""
    rng = np.random.default_rng(13)
    record = TRUE.record(rng)
    peak = signal.butter(2, np.array([149.8, 150.2]) / (RATE / 2), "bandpass", output="sos")
    force = record.samples["force"]
    line = signal.sosfilt(peak, rng.standard_normal(len(force)))
    _, band = find_resonances(TRUE.record(np.random.default_rng(13)), force="force", channels=CHANNELS)
    force[:] += 1.3 * np.std(force) / np.std(line) * line
    _, with_peak = find_resonances(record, force="force", channels=CHANNELS)
    np.testing.assert_allclose(with_peak, band, rtol=0.05, atol=0.5)


def test_h1_and_coherence_are_those_of_the_noise():
    """Noise of a response costs coherence only; noise of the force makes H1 too small by its share of the power."""
    rng = np.random.default_rng(9)
    record = TRUE.record(rng, noisy=False)
    S_force = 2 / RATE  # of unit white samples, within the band
    record.samples["acc1"] += np.sqrt(0.5 * S_force * RATE / 2) * rng.standard_normal(len(record.samples["acc1"]))
    record.samples["force"] += np.sqrt(0.25 * S_force * RATE / 2) * rng.standard_normal(len(record.samples["force"]))
    found = h1(record, force="force", resolution_Hz=1.0)
    flat = (found.frequency_Hz > 40) & (found.frequency_Hz < 120)
    truth = np.abs(TRUE.response(2 * np.pi * found.frequency_Hz[flat])[:, 0]) ** 2
    assert np.median(np.abs(found.H["acc1"][flat] / np.sqrt(truth))) == pytest.approx(1 / 1.25, rel=0.02)
    expected = 1 / 1.25 * truth / (truth + 0.5)
    assert np.mean(found.coherence["acc1"][flat]) == pytest.approx(np.mean(expected), abs=0.03)
    assert np.all(found.coherence["acc2"] <= 1 + 1e-9)


def test_lines_are_peak_amplitudes():
    n = 2048
    x = 1.7 * np.cos(2 * np.pi * 64 * np.arange(n) / RATE + 0.4)
    record = BroadbandRecord(run="r", sweep="s", time_s=0.0, sample_rate_Hz=RATE, samples={"x": x})
    frequency, amplitude = record.lines("x", (60.0, 70.0))
    assert (frequency[0], frequency[-1], record.duration_s) == (60.0, 70.0, 2.0)
    assert amplitude[frequency == 64.0][0] == pytest.approx(1.7 * np.exp(0.4j))


def test_records_are_cut_from_a_run_and_losses_bridged_and_counted():
    n = 1000
    x, f = np.linspace(0, 1, n).astype(np.float32), np.ones(n, np.float32)
    x[400:420] = np.nan
    device = DeviceSamples(
        device="daq", sample_rate_Hz=100.0, values={"x": x, "f": f}, block_start=np.array([0]),
        block_time_ns=np.array([0]), overload={},
    )  # fmt: skip
    channels = {name: Channel(name=name, quantity="force", unit="N") for name in "xf"}
    about = {"sweep": "random", "index": 0, "target_channel": "f", "target_amplitude": 1.0}
    steps = tuple(
        Step(time_ns=round(t * 1e9), frequency_Hz=f, state=s, **about)
        for t, f, s in ((1, 0.0, StepState.SETTLING), (2, 0.0, StepState.MEASURING), (8, 0.0, StepState.DONE))
    )
    run = Run(path="r", info={}, channels=channels, devices={"daq": device}, steps=steps, events=())
    (record,) = broadband_records(run)
    assert (record.duration_s, record.time_s, sum(map(len, record.missing.values()))) == (6.0, 5.0, 20)
    np.testing.assert_allclose(record.samples["x"], np.linspace(0, 1, n)[200:800], atol=1e-6)


def in_parts(monkeypatch, most):
    """From here on a record is held in memory that many samples at a time."""
    monkeypatch.setattr(spectrum, "LIMITS", replace(spectrum.LIMITS, spectrum_samples=most))


def test_a_long_record_is_reduced_part_by_part_and_no_worse_for_it(monkeypatch):
    """Three times as much, a transient to each part: errors are as stated, and smaller by the root of three."""
    rng = np.random.default_rng(3)
    records = [TRUE.record(rng, parts=3) for _ in range(4)]
    third = records[0].piece(0, records[0].length // 3)
    alone = binned(third)
    in_parts(monkeypatch, third.length + 1)
    assert [part.length for part in records[0].parts()] == [third.length] * 3
    together = [binned(record) for record in records]
    sizes = np.concatenate([np.abs(pulls(data)).ravel() ** 2 for data in together])
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.15)
    assert len(together[0].frequency_Hz) >= len(alone.frequency_Hz)
    variance = [np.median(np.einsum("boo->bo", data.relative_covariance).real) for data in (alone, together[0])]
    assert variance[0] / variance[1] == pytest.approx(3.0, rel=0.25)
    assert np.median(together[0].force_power) == pytest.approx(np.median(alone.force_power), rel=0.2)
    for name, density in {"force": FORCE_NOISE, **NOISE}.items():
        assert together[0].noise_density[name] == pytest.approx(density, rel=0.15)
    resonances, band = find_resonances(records[0], force="force", channels=CHANNELS)
    assert np.all(np.min(np.abs(resonances - np.array(TRUE.frequency_Hz)[:, None]), axis=1) < 0.26)
    np.testing.assert_allclose(band, find_resonances(third, force="force", channels=CHANNELS)[1], rtol=0.05)


def test_what_differs_between_parts_counts_as_scatter(monkeypatch):
    """The second half of a record comes from a stiffer structure: no part by itself shows it."""
    soft, stiff = (TwoModes((26.4 * f, 157.0 * f)).record(np.random.default_rng(4)) for f in (1.0, 1.002))
    samples = {name: np.concatenate([x, stiff.samples[name]]) for name, x in soft.samples.items()}
    in_parts(monkeypatch, soft.length)
    alone, both = (
        data.distortion[np.abs(data.frequency_Hz - 157) < 0.3]
        for data in (binned(soft), binned(replace(soft, samples=samples)))
    )
    assert np.max(alone) < 10 < np.min(both)


def test_a_part_without_any_sample_of_a_channel_is_left_out(monkeypatch):
    record = TRUE.record(np.random.default_rng(2), parts=2)
    half = record.length // 2
    in_parts(monkeypatch, half + 1)
    torn = replace(record, missing={"acc1": np.arange(half)})
    assert [part.heard for part in torn.parts()] == [True]
    np.testing.assert_array_equal(next(torn.parts()).samples["acc1"], record.samples["acc1"][half:])


def test_h1_and_densities_are_those_of_welch():
    record = TRUE.record(np.random.default_rng(9))
    found = h1(record, force="force", resolution_Hz=0.5)
    options = {"fs": RATE, "nperseg": int(RATE / 0.5), "window": "hann"}
    S_ff = signal.welch(record.samples["force"], **options)[1]
    S_fx = signal.csd(record.samples["force"], record.samples["acc2"], **options)[1]
    np.testing.assert_allclose(found.density["force"], S_ff, rtol=1e-10, atol=1e-20)
    np.testing.assert_allclose(found.H["acc2"], S_fx / S_ff, rtol=1e-9)
