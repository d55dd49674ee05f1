"""Responses find the rig's channels by name, by place and direction, by reciprocity, or as the only one."""

import numpy as np
import pytest

from recordings.errors import InputError
from recordings.responses import End, FoundResponse, Responses
from twin.identify.responses.matching import match_responses

F = np.arange(1, 40) * 1.0
NODES = {1: (0.06, 0.0, 0.0), 2: (0.35, 0.0, 0.0), 3: (0.66, 0.001, 0.0), 4: (0.7, 0.0, 0.0), 5: (0.0, 0.0, 0.0)}


def file(*ends, nodes=NODES):
    found = [
        FoundResponse(place=f"set {n}", response=a, reference=b, quantity="", frequency_Hz=F, H=F + 0j)
        for n, (a, b) in enumerate(ends, 1)
    ]
    return Responses(path="a.uff", responses=tuple(found), nodes=nodes)


def matched(*ends, rig, **more):
    found, told = match_responses(file(*ends, **more), rig)
    return [(one.channel, one.sign) for one in found], told


def test_by_name(lab):
    found, told = matched((End("tip"), End("force")), (End("mid"), End("force")), rig=lab.rig)
    assert (found, told) == ([("tip", 1.0), ("mid", 1.0)], ())


def test_a_reference_that_is_not_named_is_the_drive(lab):
    found, _ = matched((End("tip"), End()), (End("mid"), End()), rig=lab.rig)
    assert found == [("tip", 1.0), ("mid", 1.0)]


@pytest.mark.parametrize(("response", "force", "sign"), [("+y", "+y", 1.0), ("-y", "+y", -1.0), ("-y", "-y", 1.0)])
def test_by_place_and_direction(lab, response, force, sign):
    found, _ = matched((End("", 3, response), End("", 1, force)), rig=lab.rig)
    assert found == [("tip", sign)]


def test_hammer_and_sensor_the_other_way_round(lab):
    found, _ = matched((End("", 1, "+y"), End("", 3, "-y")), rig=lab.rig)
    assert found == [("tip", -1.0)]


def test_what_the_rig_has_not_is_told(lab):
    found, told = matched((End("", 3, "+y"), End("", 1, "+y")), (End("", 4, "+y"), End("", 1, "+y")), rig=lab.rig)
    assert found == [("tip", 1.0)]
    assert told[0].startswith("set 2: node 4 +y over node 1 +y is none")


def test_across_is_no_match(lab):
    with pytest.raises(InputError, match="none of its responses"):
        matched((End("", 3, "+x"), End("", 1, "+y")), rig=lab.rig)


def test_one_response_of_one_sensor(lab):
    alone = lab.rig.model_copy(update={"sensor": [s for s in lab.rig.sensor if s.channel != "mid"]})
    found, told = matched((End("Ch 2", 17), End("Ch 1", 12)), rig=alone, nodes={})
    assert found == [("tip", 1.0)]
    assert "both are alone" in told[0]
