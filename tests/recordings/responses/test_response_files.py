"""Frequency responses in universal files, CSV and NumPy archives, against pyuff and numpy as writers."""

import warnings

import numpy as np
import pytest
import pyuff

from recordings.errors import InputError
from recordings.responses import are_responses, read_responses

F = np.arange(1, 101) * 0.5
H = 1.0 / (400 - F**2 + 0.4j * F)


def universal(path, **changed):
    head = {
        "type": 58, "binary": 0, "func_type": 4, "rsp_ent_name": "tip", "rsp_node": 7, "rsp_dir": -2,
        "ref_ent_name": "hammer", "ref_node": 3, "ref_dir": 2, "abscissa_spacing": 1, "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13, "ordinate_axis_units_lab": "NONE",
        "orddenom_axis_units_lab": "NONE", "x": F, "data": H,
    }  # fmt: skip
    sets = changed.pop("sets", [{}])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(path)).write_sets([{**head, **changed, **own} for own in sets], mode="add")
    return path


@pytest.mark.parametrize("binary", [0, 1])
def test_universal_file_as_pyuff_writes_it(tmp_path, binary):
    (found,) = read_responses(universal(tmp_path / "a.uff", binary=binary)).responses
    assert found.quantity == "acceleration"
    assert (found.response.name, found.response.node, found.response.direction) == ("tip", 7, "-y")
    assert (found.reference.node, found.reference.direction) == (3, "+y")
    np.testing.assert_allclose(found.frequency_Hz, F)
    np.testing.assert_allclose(found.H, H, rtol=1e-6)


def test_several_responses_and_references_with_their_coherences(tmp_path):
    own = [{"rsp_node": node, "ref_node": reference} for node in (7, 8) for reference in (3, 4)]
    coherence = [{**one, "func_type": 6, "data": np.full(len(F), 0.9) + 0j} for one in own[:1]]
    file = read_responses(universal(tmp_path / "a.uff", sets=[*own, *coherence], id2="averages = 12"))
    assert [(one.response.node, one.reference.node) for one in file.responses] == [(7, 3), (7, 4), (8, 3), (8, 4)]
    np.testing.assert_allclose(file.responses[0].coherence, 0.9)
    assert file.responses[1].coherence is None
    assert file.responses[0].averages == 12


@pytest.mark.parametrize(
    ("labels", "quantity", "factor"),
    [
        (("g", "N"), "acceleration", 9.80665),
        (("in/s^2", "lbf"), "acceleration", 0.0254 / 4.4482216152605),
        (("(mm/s)/N", "NONE"), "velocity", 1e-3),
    ],
)
def test_units_are_converted(tmp_path, labels, quantity, factor):
    above, below = labels
    path = universal(tmp_path / "a.uff", ordinate_axis_units_lab=above, orddenom_axis_units_lab=below)
    (found,) = read_responses(path).responses
    assert found.quantity == quantity
    np.testing.assert_allclose(found.H, factor * H, rtol=1e-6)


def test_units_of_the_whole_file_where_the_labels_are_blank(tmp_path):
    path = tmp_path / "a.uff"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        units = {"type": 164, "units_code": 7, "units_description": "in lbf", "temp_mode": 1, "length": 39.37007874,
                 "force": 0.2248089431, "temp": 1.8, "temp_offset": 459.67}  # fmt: skip
        pyuff.UFF(str(path)).write_sets([units], mode="add")
    (found,) = read_responses(universal(path)).responses
    np.testing.assert_allclose(found.H, H * 0.0254 / 4.4482216152605, rtol=1e-6)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"ordinate_spec_data_type": 15}, "type codes"),
        ({"ordinate_axis_units_lab": "Pa", "orddenom_axis_units_lab": "N"}, "none of a displacement"),
        ({"func_type": 9}, "no frequency response"),
        ({"data": np.abs(H)}, "without phase"),
        ({"x": F[:8], "data": H[:8]}, "at least"),
    ],
)
def test_what_is_no_response_is_one_line(tmp_path, changed, told):
    with pytest.raises(InputError, match=told):
        read_responses(universal(tmp_path / "a.uff", **changed))


def test_modes_and_nodes_of_a_universal_file(tmp_path):
    path = tmp_path / "modes.unv"
    shape = np.array([0.1, 0.4, 1.0])
    mode = {
        "type": 55, "model_type": 1, "id1": "NONE", "id2": "NONE", "id3": "NONE", "id4": "NONE", "id5": "NONE",
        "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2, "n_data_per_node": 3,
        "load_case": 1, "mode_n": 1, "freq": 12.5, "modal_m": 1.0, "modal_damp_vis": 0.01, "modal_damp_his": 0.0,
        "node_nums": [1, 2, 3], "r1": 0 * shape, "r2": shape, "r3": 0 * shape,
    }  # fmt: skip
    nodes = {"type": 15, "node_nums": [1, 2, 3], "def_cs": [0] * 3, "disp_cs": [0] * 3, "color": [1] * 3,
             "x": [0.1, 0.2, 0.3], "y": [0.0] * 3, "z": [0.0] * 3}  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(path)).write_sets([nodes, mode], mode="add")
    file = read_responses(path)
    (found,) = file.modes
    assert (found.frequency_Hz, found.damping_ratio) == (12.5, 0.01)
    np.testing.assert_allclose(found.shape[:, 1], shape)
    assert file.nodes[2] == (0.2, 0.0, 0.0)


def test_csv_in_two_spellings(tmp_path):
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    rows = [f"{f},{h.real},{h.imag}" for f, h in zip(F, H, strict=True)]
    one.write_text("frequency_Hz,real,imag\n" + "\n".join(rows))
    polar = [f"tip,{f},{abs(h)},{np.angle(h, deg=True)},g/N" for f, h in zip(F, H, strict=True)]
    other.write_text("response,frequency_Hz,amplitude,phase_deg,unit\n" + "\n".join(polar))
    assert are_responses(one)
    (first,), (second,) = (read_responses(path).responses for path in (one, other))
    np.testing.assert_allclose(first.H, H)
    np.testing.assert_allclose(second.H, 9.80665 * H)
    assert (second.response.name, second.quantity) == ("tip", "acceleration")


def test_a_table_of_sweeps_is_none(tmp_path):
    path = tmp_path / "sweeps.csv"
    path.write_text("level,frequency_Hz,force_N,acceleration_m_per_s2,phase_rad\n1,10,1,1,0\n")
    assert not are_responses(path)


def test_archive_as_sdypy_has_it(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, frequency_Hz=F, frf=np.stack([H, 2 * H]), channels=["a", "b"], frf_form="mobility", averages=8,
             coherence=np.full((2, len(F)), 0.99))  # fmt: skip
    first, second = read_responses(path).responses
    assert (first.response.name, second.response.name, first.quantity) == ("a", "b", "velocity")
    assert first.averages == 8
    np.testing.assert_allclose(second.H, 2 * H)


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"frequency_Hz": F}, "no frf"),
        ({"frequency_Hz": F, "frf": np.abs(H)}, "complex"),
        ({"frequency_Hz": F, "frf": H, "frf_form": "inertance"}, "one of"),
        ({"frequency_Hz": F, "frf": H, "coherence": 2 * np.ones(len(F))}, "coherence"),
        ({"frequency_Hz": F[::-1], "frf": H}, "do not rise"),
        ({"frequency_Hz": F, "frf": H, "channels": np.array([object()], object)}, "plain arrays"),
    ],
)
def test_wrong_archives_are_one_line(tmp_path, arrays, told):
    path = tmp_path / "a.npz"
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=told):
        read_responses(path)
