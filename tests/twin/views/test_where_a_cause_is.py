"""The region of a cause's place on the structure, for every kind of place, and its picture in the report."""

import numpy as np
import pytest

from twin.diagnose.answer.result import Estimate, NamedCause
from twin.identify.forward.predict import blank_data
from twin.rigs import Place, load_rig
from twin.structure import point_of
from twin.views.reports.where import region, where_figure, where_section


def named(cause, **parameters):
    return NamedCause(
        cause=cause, summary="", probability=1.0, confused_with=(), parameters=parameters, in_model=True
    )  # fmt: skip


@pytest.fixture(scope="module")
def evidence():
    return {name: blank_data(load_rig(name)) for name in ("steel-lap-joint", "two-lap-joints", "l-frame")}


def test_a_place_along_a_part_is_two_deviations_long_and_ends_with_the_part(evidence):
    two = evidence["two-lap-joints"]
    points = region(two, named("added-mass", part="end", position_m=Estimate(0.1, 0.01), mass_kg=Estimate(0.03, 0.001)))
    start, end = (point_of(two.model.structure, Place("end", s, (0, 1, 0))) for s in (0.1 - 0.0196, 0.1 + 0.0196))
    np.testing.assert_allclose([points[0], points[-1]], [start, end], atol=1e-12)
    beyond = region(two, named("added-mass", part="end", position_m=Estimate(0.165, 0.05)))
    np.testing.assert_allclose(beyond[:, 0].max(), 0.47)


def test_a_place_along_the_whole_structure_passes_from_beam_to_beam(evidence):
    points = region(evidence["steel-lap-joint"], named("added-mass", position_m=Estimate(0.235, 0.05)))
    assert len(np.unique(np.round(points[:, 1], 6))) == 2


def test_joints_beams_supports_and_sensors_have_their_regions(evidence):
    two, frame = evidence["two-lap-joints"], evidence["l-frame"]
    inner = region(two, named("joint-slap", joint="inner", gap_m=Estimate(1e-6, 1e-7)))
    assert inner[:, 0].min() > 0.15
    assert inner[:, 0].max() < 0.2
    steel = evidence["steel-lap-joint"]
    assert len(region(steel, named("preload-loss", rate_per_s=Estimate(1e-4, 1e-5))))
    assert len(region(frame, named("beam-modulus", beam="arm", factor=Estimate(0.9, 0.01)))) > 5
    held = frame.rig.layout().supports[0]
    support = region(frame, named("clamp-compliance", support=held.part))
    np.testing.assert_allclose(support[0], point_of(frame.model.structure, Place(held.part, held.at, (0, 1, 0))))
    moved = region(two, named("sensor-position", channel="acc1", offset_m=Estimate(0.01, 0.001)))
    here = point_of(two.model.structure, two.rig.place_of("acc1"))
    np.testing.assert_allclose(np.linalg.norm(moved - here, axis=1)[[0, -1]], [0.00804, 0.01196], rtol=1e-6)


@pytest.mark.parametrize("cause", ["channel-gain", "sample-clock", "air-drag"])
def test_what_has_no_place_has_no_region(evidence, cause):
    assert region(evidence["two-lap-joints"], named(cause, channel="acc1", factor=Estimate(1.1, 0.1))).shape == (0, 3)


def test_nodes_of_a_region_are_drawn_in_space():
    plate = blank_data(load_rig("stiffened-plate"))
    points = region(plate, named("added-mass", part="plate", node=Estimate(18.0, 0.0), nodes_95=(17, 18, 19)))
    assert points.shape == (3, 3)
    figure = where_figure(plate, {"added-mass": points}, added=Place("plate", 5.0, (0, 0, 1)))
    told = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert {"added-mass", "drive", "sensor", "sensor to add"} <= set(told)


def test_a_report_draws_where_a_cause_is(diagnosis):
    section = where_section(diagnosis)
    assert section is not None
    (picture,) = section.pictures
    assert diagnosis.causes[0].cause in picture.caption
    assert picture.draw().axes
