"""Noise and bins of measured responses, against responses in closed form with known noise."""

import numpy as np
import pytest

from recordings.errors import InputError
from recordings.responses import End, FoundResponse
from twin.identify.responses.limits import LIMITS
from twin.identify.responses.matching import Matched
from twin.identify.responses.reduction import noise_of, reduce_responses, resonances_of

F = np.arange(40, 1600) * 0.25


def oscillators(f):
    """Two modes of one per cent damping."""
    return sum(f**2 / (f0**2 - f**2 + 0.02j * f0 * f) for f0 in (60.0, 210.0))


def found(H, **more):
    return FoundResponse(place="set 1", response=End("a"), reference=End("force"), quantity="acceleration",
                         frequency_Hz=F, H=H, **more)  # fmt: skip


def noisy(rng, size):
    return oscillators(F) * (1 + size * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F))) / 2**0.5)


@pytest.mark.parametrize("size", [0.003, 0.03])
def test_noise_from_neighbours(size):
    rng = np.random.default_rng(int(1e4 * size))
    told = np.median(noise_of(found(noisy(rng, size))))
    assert told == pytest.approx(size**2, rel=0.2)


def test_noise_from_coherence_and_averages():
    told = noise_of(found(oscillators(F), coherence=np.full(len(F), 0.9), averages=20))
    # Of the complex error: twice (1 - g2) / (2 n g2) of its magnitude.
    np.testing.assert_allclose(told, 2 * (1 - 0.9) / (2 * 20 * 0.9))


def test_a_coherence_of_few_averages_tells_no_noise():
    """Of one it is one, whatever the noise."""
    H = noisy(np.random.default_rng(9), 0.02)
    told = noise_of(found(H, coherence=np.ones(len(F)), averages=1))
    assert np.median(told) == pytest.approx(0.02**2, rel=0.2)


def test_coherence_without_averages_is_scaled_by_the_neighbours():
    rng = np.random.default_rng(5)
    sizes = np.where(F < 200, 0.01, 0.04)
    H = oscillators(F) * (1 + sizes * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F))) / 2**0.5)
    told = noise_of(found(H, coherence=1 / (1 + 50 * sizes**2)))
    np.testing.assert_allclose([np.median(told[F < 200]), np.median(told[F > 200])], [0.01**2, 0.04**2], rtol=0.3)


def test_bins_follow_the_response_and_say_their_noise():
    data = reduce_responses(
        "a", [Matched("a", -1.0, found(-noisy(np.random.default_rng(3), 0.02)))], ["a"], band_Hz=(20, 300)
    )
    left = np.log(data.H[:, 0] / oscillators(data.frequency_Hz))
    std = np.sqrt(data.relative_covariance[:, 0, 0].real)
    assert len(data.H) < 0.4 * len(F)
    assert np.mean(np.abs(left / std) ** 2) < 1.2
    assert np.all(std >= LIMITS.reproduced)


def test_resonances():
    np.testing.assert_allclose(resonances_of(F, oscillators(F)[:, None]), [60.0, 210.0], atol=0.5)


def test_channels_on_other_axes_are_refused():
    other = FoundResponse(**{**vars(found(oscillators(F))), "frequency_Hz": F + 0.1, "place": "set 2"})
    pair = [Matched("a", 1.0, found(oscillators(F))), Matched("b", 1.0, other)]
    with pytest.raises(InputError, match="set 2"):
        reduce_responses("x.uff", pair, ["a", "b"], band_Hz=(20, 300))


def test_nothing_in_the_band_is_refused():
    with pytest.raises(InputError, match="stand out"):
        reduce_responses("x.uff", [Matched("a", 1.0, found(oscillators(F)))], ["a"], band_Hz=(2000, 3000))
