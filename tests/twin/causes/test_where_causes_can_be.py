"""Where a rig can have a cause: what a diagnosis seeks and what the bench can hide agree, for rigs of every kind."""

import pytest
from small_rigs import DRAWN, rig_file

from twin.campaign.plan import fitting_causes
from twin.diagnose.models import CAUSES
from twin.identify.forward.predict import blank_data
from twin.rigs import RIG_FILES, load_rig

OF_JOINTS = ("joint-stiffness", "joint-slap", "joint-uneven", "preload-loss")


@pytest.mark.parametrize("name", [*RIG_FILES, *DRAWN])
def test_what_can_be_hidden_can_be_sought(name, tmp_path):
    rig = load_rig(rig_file(name, tmp_path))
    labels = {cause: CAUSES[cause].labels(blank_data(rig)) for cause in ("base-motion", *OF_JOINTS)}
    assert {cause for cause, found in labels.items() if found} == set(fitting_causes(rig, [*labels]))
    assert bool(labels["base-motion"]) == bool(rig.layout().supports), "a base moves what it holds"
    names = [joint.name for joint in rig.joints]
    for cause in OF_JOINTS:
        assert [label.get("joint", names[0]) for label in labels[cause]] == names
