"""A broadband record of the steel rig reduced against a wrong belief, on a rig that is summed mode by mode."""

from unittest.mock import Mock

import numpy as np
import pytest
from beam_rows import deflection

from twin.identify.linear.linear_fit import reduce_broadband
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.modes import from_record
from twin.identify.spectra.spectrum import BroadbandRecord
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes

RATE, SECONDS, PERIOD = 2560.0, 30.0, 90.0
FORCE_NOISE, NOISE = 2e-4, 5e-4
ZETA = np.array([0.0030, 0.0016, 0.0026, 0.0021])


def inertance(s, E, G):
    """Responses (f, 2) per newton at given omega, summed mode by mode."""
    modes = normal_modes(s.M, s.stiffness(E, G))
    zeta = np.concatenate([ZETA, np.full(len(modes.omega) - 4, 0.003)])
    residues = (np.array([deflection(s, 0.30), deflection(s, 0.42)]) @ modes.Phi) * (deflection(s, 0.05) @ modes.Phi)

    def response(omega):
        w = np.asarray(omega)[:, None]
        return -(w**2) * ((1 / (modes.omega**2 - w**2 + 2j * zeta * modes.omega * w)) @ residues.T)

    return response


def recorded(response, rng, *, turned=()):
    """Half a minute cut out of a much longer random force, so that the responses were under way before.

    Channels that are `turned` have the wrong sign.
    """
    count, cut = int(PERIOD * RATE), int(SECONDS * RATE)
    f = np.fft.rfftfreq(count, 1 / RATE)
    inside = (f > 5) & (f < 1000)
    H = np.zeros((len(f), 2), complex)
    H[inside] = response(2 * np.pi * f[inside])
    U = inside * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
    U *= 0.5 / np.std(np.fft.irfft(U, count))
    signals = {"force": U, "acc1": H[:, 0] * U, "acc2": H[:, 1] * U}
    samples = {name: np.fft.irfft(X, count)[:cut] for name, X in signals.items()}
    for name in samples:
        density = FORCE_NOISE if name == "force" else NOISE
        samples[name] = samples[name] + density * np.sqrt(RATE / 2) * rng.standard_normal(cut)
    samples |= {name: -samples[name] for name in turned}
    return BroadbandRecord(run="r", sweep="s", time_s=0.0, sample_rate_Hz=RATE, samples=samples)


@pytest.fixture(scope="module")
def steel():
    """The true rig: moduli wrong by eight per cent, damping by more; responses (f, 2) per newton at given omega."""
    s, nominal = assemble(load_rig("steel-lap-joint")), nominal_parameters(load_rig("steel-lap-joint"))
    omega = normal_modes(s.M, s.stiffness(1.08 * nominal.E, 0.93 * nominal.G)).omega
    return omega / (2 * np.pi), inertance(s, 1.08 * nominal.E, 0.93 * nominal.G)


@pytest.fixture(scope="module")
def reductions(steel, steel_model):
    """Half a minute each, cut out of a much longer random force, so that the responses were under way before."""
    _, response = steel
    rng = np.random.default_rng(31)
    nominal = nominal_parameters(load_rig("steel-lap-joint"))
    return [reduce_broadband(steel_model, recorded(response, rng), nominal, force="force") for _ in range(3)]


@pytest.mark.slow
def test_errors_of_the_bins_are_what_they_say(steel, reductions):
    sizes = []
    for data, _ in reductions:
        error = np.log(data.H / steel[1](data.omega))
        white = np.linalg.solve(np.linalg.cholesky(data.relative_covariance), error[:, :, None])[:, :, 0]
        sizes.append(np.abs(white) ** 2)
    sizes = np.concatenate(sizes)
    assert np.median(sizes) == pytest.approx(np.log(2), rel=0.15)
    assert np.mean(sizes) < 1.5


def test_noise_densities_are_found(reductions):
    for data, _ in reductions:
        found = [data.noise_density[name] for name in ("force", "acc1", "acc2")]
        np.testing.assert_allclose(found, [FORCE_NOISE, NOISE, NOISE], rtol=0.25)


def test_the_fit_finds_resonances_and_damping_whatever_the_belief(steel, steel_model, reductions):
    """Frequency discrepancy are free here, so that moduli are not judged: natural frequencies and total damping are."""
    s = steel_model.structure
    for _, fit in reductions:
        modes = normal_modes(s.M, s.stiffness(fit.base.E, fit.base.G), 4)
        found_Hz = modes.frequency_Hz * np.sqrt(1 + 2 * fit.base.frequency_discrepancy[:4])
        np.testing.assert_allclose(found_Hz[:3], steel[0][:3], rtol=2e-4)
        joint = fit.base.E * fit.base.loss_E * np.sum((s.joints[0].B_E @ modes.Phi) ** 2, axis=0)
        joint = joint + fit.base.G * fit.base.loss_G * np.sum((s.joints[0].B_G @ modes.Phi) ** 2, axis=0)
        total = fit.base.zeta[:4] + joint / (2 * modes.omega**2)
        np.testing.assert_allclose(total[:3], ZETA[:3], rtol=0.03)


@pytest.mark.parametrize(
    "factors", [(0.7, 0.62), *(pytest.param(same, marks=pytest.mark.slow) for same in ((0.75, 0.75), (1.4, 1.4)))]
)
def test_moduli_far_from_belief_are_no_trap(steel_model, factors):
    """Followed from what is assumed, the shapes lead into a false minimum."""
    nominal = nominal_parameters(load_rig("steel-lap-joint"))
    s = assemble(load_rig("steel-lap-joint"))
    record = recorded(inertance(s, factors[0] * nominal.E, factors[1] * nominal.G), np.random.default_rng(32))
    _, fit = reduce_broadband(steel_model, record, nominal, force="force")
    assert fit.chi2_per_dof < 1.5


@pytest.mark.slow
def test_a_channel_that_is_turned_round_is_no_trap(steel, steel_model, monkeypatch):
    """And is looked for without binning the record anew for each channel: of many that takes longer than all else."""
    binned = Mock(wraps=from_record.bin_response)
    monkeypatch.setattr(from_record, "bin_response", binned)
    nominal = nominal_parameters(load_rig("steel-lap-joint"))
    found, calls = [], []
    for names in ((), ("acc2",)):
        record = recorded(steel[1], np.random.default_rng(32), turned=names)
        found.append(reduce_broadband(steel_model, record, nominal, force="force"))
        calls.append(binned.call_count - sum(calls))
    upright, turned = found
    assert calls[1] == calls[0], "no more than of a record as it should be"
    assert turned[1].chi2_per_dof < 1.5
    np.testing.assert_allclose(turned[0].H * [1, -1], upright[0].H, rtol=1e-3)
