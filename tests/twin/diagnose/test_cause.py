"""What every cause says of itself."""

import numpy as np
import pytest

from twin.diagnose.cause import Parameter, thresholds
from twin.diagnose.limits import LIMITS


@pytest.mark.parametrize("least", [0.01, 0.05, 0.2])
def test_no_threshold_is_far_from_a_beginning(least):
    """A fit begins within a sixth of it, wherever the motion may meet the effect."""
    starts = np.array(thresholds(3e-6, least=least))
    for threshold in np.geomspace(least, 1.0, 200) * 3e-6:
        assert np.min(np.abs(np.log(starts / threshold))) < 0.55 * np.log(LIMITS.cause_ratio)
    assert abs(np.log(starts[0] / 1.5e-6)) <= 0.55 * np.log(LIMITS.cause_ratio)


def test_a_threshold_is_neither_a_place_nor_a_strength():
    limits = {"scale": 1.0, "lower": 0.0, "upper": 1.0}
    assert Parameter(name="gap_m", **limits).is_threshold
    assert not Parameter(name="position_m", **limits).is_threshold
    assert not Parameter(name="mass_kg", null=0.0, **limits).is_threshold
