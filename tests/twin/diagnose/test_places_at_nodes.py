"""A cause on a part given by matrices is sought between its nodes and told at one of them, with a region."""

import numpy as np
import pytest

from recordings import RunWriter, read_run
from twin.bench import open_bench
from twin.demo import broadband
from twin.diagnose import diagnose
from twin.diagnose.models import CAUSES
from twin.diagnose.places import from_told_place, node_field, place_at, place_labels, position, told_place
from twin.identify.forward.predict import blank_data
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import Effect, Place, load_rig, preload_name, preload_record
from twin.structure import NodeField

PLATE = load_rig("stiffened-plate")


@pytest.fixture(scope="module")
def evidence():
    return blank_data(PLATE)


def test_a_field_has_a_plates_two_ways_and_pushes_across_it():
    x, y = np.meshgrid(np.linspace(0, 0.3, 7), np.linspace(0, 0.2, 5))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    # Two layers of a thin solid: the outer one is searched.
    both = np.vstack([points, points + np.array([0, 0, 0.004])])
    field = NodeField.of(np.arange(100, 100 + len(both)), both)
    assert len(field.nodes) == len(points)
    np.testing.assert_allclose(field.extent, [0.3, 0.2])
    np.testing.assert_allclose(np.abs(field.across), [[0, 0, 1]], atol=1e-12)
    at = field.position(int(field.nodes[8]))
    assert field.nearest(at + 1e-3) == field.nodes[8]


def test_between_nodes_a_linear_motion_is_that_of_its_plane():
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0, 0.3, 40), rng.uniform(0, 0.2, 40), np.zeros(40)])
    field = NodeField.of(np.arange(40), points)
    motion = dict(zip(field.nodes.tolist(), field.coordinates @ [3.0, -2.0] + 1.0, strict=True))
    for _ in range(20):
        at = field.coordinates[rng.integers(0, 40, 3)].mean(axis=0)
        shares = field.weights(at)
        assert sum(share for _, share in shares) == pytest.approx(1.0)
        assert sum(share * motion[node] for node, share in shares) == pytest.approx(at @ [3.0, -2.0] + 1.0)


def test_a_solid_is_searched_in_three_directions_along_three_axes():
    points = np.random.default_rng(2).uniform(0, 1, (60, 3)) * [0.3, 0.2, 0.1]
    field = NodeField.of(np.arange(60), points)
    assert field.coordinates.shape == (60, 3)
    assert len(field.across) == 3


def test_nothing_pushes_in_a_direction_that_no_node_has():
    x = np.linspace(0.0, 0.3, 7)
    bar = NodeField.of(np.arange(7), np.column_stack([x, 0 * x, 0 * x]), moving=(True, True, False))
    assert bar.across == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    frame = NodeField.of(np.arange(7), np.column_stack([x, x**2, 0 * x]), moving=(True, True, False))
    assert frame.across == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def test_a_region_holds_the_nodes_of_its_ellipse_and_never_none():
    x, y = np.meshgrid(np.arange(11) * 0.01, np.arange(6) * 0.01)
    field = NodeField.of(np.arange(66), np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]))
    at = field.position(27)
    inside = field.within(at, np.array([0.0101, 1e-4]), 1.01)
    assert len(inside) == 3
    assert 27 in inside
    assert field.within(at + 2e-3, np.array([1e-9, 1e-9]), 5.99) == (27,)


def test_a_place_goes_to_its_node_and_back(evidence):
    for label in place_labels(evidence):
        field = node_field(evidence, label)
        node = int(field.nodes[len(field.nodes) // 3])
        values = from_told_place(evidence, label, {"mass_kg": 0.1, "node": float(node)})
        assert sorted(values) == sorted(["mass_kg", *(p.name for p in position(evidence, label))])
        told, _, nodes = told_place(evidence, label, values, {})
        assert told == {"mass_kg": 0.1, "node": float(node)}
        assert nodes == (node,)
        place = place_at(evidence, label, values)
        row, at_node = (evidence.model.structure.row(p) for p in (place, Place(place.part, node, place.direction)))
        np.testing.assert_allclose(row, at_node, atol=1e-9 * np.max(np.abs(at_node)))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CAUSES))
def test_every_cause_reports_its_places_between_nodes_as_the_search_has_them(evidence, name):
    for label in CAUSES[name].labels(evidence):
        parameters = CAUSES[name].parameters(evidence, label)
        values = {p.name: p.starts[0] for p in parameters}
        reported, std = CAUSES[name].reported(values, values)
        places = {p.name for p in parameters if "position" in p.name}
        assert places <= set(reported)
        assert set(std) == set(reported)


def test_a_mass_on_the_plate_is_found_at_its_node(tmp_path):
    part = "plate"
    hidden = {"part": part, "node": 18.0, "mass_kg": 0.04}
    acquisition = DirectAcquisition(open_bench(PLATE, seed=8, effects=[Effect(cause="added-mass", parameters=hidden)]))
    path = tmp_path / "noise.mcap"
    info = {"source": "simulated", "rig": PLATE.name, "stored": "settled"} | preload_record(preload_name(PLATE))
    with RunWriter(path, info=info, channels=acquisition.channels) as writer:
        assert run_procedure(broadband(), acquisition, writer).state == "done"
    found = diagnose([read_run(path)], PLATE).to_dict()
    first = found["causes"][0]
    assert first["cause"] == "added-mass"
    assert first["parameters"]["part"] == part
    mass = first["parameters"]["mass_kg"]
    assert abs(mass["value"] - 0.04) < max(3 * mass["std"], 0.03 * 0.04)
    assert 18 in first["parameters"]["nodes_95"]
