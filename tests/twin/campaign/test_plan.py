"""Which causes a campaign hides in which rig."""

import pytest
from small_rigs import rig_file

from twin.campaign import campaign_causes, fitting_causes
from twin.rigs import load_rig

OF_JOINTS = {"joint-stiffness", "joint-slap", "joint-friction", "joint-uneven", "preload-loss"}
OF_BEAMS = {"air-drag", "beam-modulus", "transverse-shear", "stiffness-loss"}
HELD, MOVED = {"clamp-compliance"}, {"sensor-position", "drive-position"}
HUNG = HELD | {"base-motion"}


@pytest.mark.parametrize(
    ("name", "without"),
    [
        ("steel-lap-joint", set()), ("two-lap-joints", set()), ("hung-lap-joint", HUNG),
        ("stiffened-plate", HUNG | OF_BEAMS | MOVED), ("beam-clamped", OF_JOINTS), ("beam-hung", OF_JOINTS | HUNG),
        ("matrices-clamped", OF_JOINTS | HELD | OF_BEAMS | MOVED), ("bars-in-space", set()),
    ],
)  # fmt: skip
def test_a_rig_is_given_the_causes_that_it_can_have(name, without, tmp_path):
    causes = (*campaign_causes(), "none")
    assert set(causes) - set(fitting_causes(load_rig(rig_file(name, tmp_path)), causes)) == without
