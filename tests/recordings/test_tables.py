"""Tables of sweeps and natural frequencies: read, told apart, refused with line and column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings import InputError
from recordings.tables import FrequencyTable, SweepTable, read_table

MEASURED = Path(__file__).parents[1] / "data" / "recordings" / "brake_reuss_response_control.csv"
HEAD = "level,frequency_Hz,force_N,acceleration_m_per_s2,phase_rad\n"


def test_measured_sweeps_are_read_as_numpy_reads_them() -> None:
    table = read_table(MEASURED)
    assert isinstance(table, SweepTable)
    expected = np.genfromtxt(MEASURED, delimiter=",", names=True)
    for name, values in (
        ("level", table.level), ("frequency_Hz", table.frequency_Hz), ("force_N", table.force_N),
        ("acceleration_m_per_s2", table.response), ("phase_rad", table.phase_rad),
    ):  # fmt: skip
        np.testing.assert_array_equal(values, expected[name])
    assert table.quantity == "acceleration"
    assert [len(rows) for rows in table.sweeps().values()] == [41] * 8
    assert table.line[0] == 2
    rows = table.sweeps()[3.0]
    assert set(table.level[rows]) == {3.0}


@pytest.mark.parametrize(("column", "quantity"), [("velocity_m_per_s", "velocity"), ("displacement_m", "displacement")])
def test_other_responses(tmp_path: Path, column: str, quantity: str) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"# by hand\n{column},level,note,frequency_Hz,force_N\n\n1e-3, 1,x,25.5,0.5\n", "utf-8-sig")
    table = read_table(path)
    assert isinstance(table, SweepTable)
    assert (table.quantity, table.response[0], table.frequency_Hz[0], table.line[0]) == (quantity, 1e-3, 25.5, 4)
    assert np.isnan(table.phase_rad).all()


def test_natural_frequencies(tmp_path: Path) -> None:
    path = tmp_path / "modes.csv"
    path.write_text("mode,frequency_Hz,std_Hz\n1,26.1,0.02\n3,240,0.1\n")
    table = read_table(path)
    assert isinstance(table, FrequencyTable)
    assert (table.mode.tolist(), table.frequency_Hz.tolist(), table.std_Hz.tolist()) == (
        [1, 3],
        [26.1, 240],
        [0.02, 0.1],
    )
    path.write_text("mode,frequency_Hz\n1,26.1\n")
    table = read_table(path)
    assert isinstance(table, FrequencyTable)
    assert np.isnan(table.std_Hz).all()


def test_natural_frequencies_of_several_preloads_stand_in_one_table(tmp_path: Path) -> None:
    path = tmp_path / "modes.csv"
    path.write_text("preload,mode,frequency_Hz\n120N,1,26.5\n\n540N , 1,26.6\n")
    table = read_table(path)
    assert isinstance(table, FrequencyTable)
    assert (table.preload, table.mode.tolist(), table.line.tolist()) == (("120N", "540N"), [1, 1], [2, 4])
    path.write_text("mode,frequency_Hz\n1,26.5\n")
    plain = read_table(path)
    assert isinstance(plain, FrequencyTable)
    assert plain.preload == ("",)


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", "", "is empty"),
        (HEAD, "", "has 0 rows"),
        ("level,frequency_Hz,force_N\n1,2,3\n", "line 1", "none of the columns"),
        (HEAD.replace("phase_rad", "velocity_m_per_s") + "1,2,3,4,5\n", "line 1", "2 of the columns"),
        ("a,b\n1,2\n", "line 1", "no column 'level'"),
        ("mode,mode,frequency_Hz\n1,1,2\n", "line 1", "stands twice"),
        (HEAD + "0,79,1,5,0\n0,79.1,1,5\n", "line 3", "has 4 values for 5 columns"),
        (HEAD + "0,79,1,5,0\n0,79.1,abc,5,0\n", "line 3, column force_N", "'abc' is not a number"),
        (HEAD + "0,79,1,5,0\n0,79.1,nan,5,0\n", "line 3, column force_N", "'nan' is not a number"),
        (HEAD + "0,79,1,5,0\n0,0,1,5,0\n", "line 3, column frequency_Hz", "not above zero"),
        (HEAD + "0,79,-1,5,0\n", "line 2, column force_N", "negative"),
        ("mode,frequency_Hz\n1,20\n1,30\n", "line 3, column mode", "twice"),
        ("preload,mode,frequency_Hz\n120N,1,20\n120N,1,30\n", "line 3, column mode", "twice at preload 120N"),
        ("preload,mode,frequency_Hz\n,1,20\n", "line 2, column preload", "not a name"),
        ("mode,frequency_Hz\n1.5,20\n", "line 2, column mode", "not the number of a mode"),
        ("mode,frequency_Hz,std_Hz\n1,20,-1\n", "line 2, column std_Hz", "negative"),
        (HEAD + '0,79,"1,5,0\n', "line 2", "CSV"),
    ],
)
def test_wrong_table_is_refused_with_line_and_column(tmp_path: Path, text: str, place: str, reason: str) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_table(path)
    assert caught.value.place == place
    assert reason in caught.value.reason
    assert "\n" not in str(caught.value)


@settings(max_examples=300, deadline=None)
@given(place=st.integers(0, 400), piece=st.binary(max_size=12), cut=st.integers(0, 400))
def test_rubbish_gives_a_table_or_one_clear_error(
    tmp_path_factory: pytest.TempPathFactory, place: int, piece: bytes, cut: int
) -> None:
    data = MEASURED.read_bytes()[:400]
    path = tmp_path_factory.getbasetemp() / "fuzzed.csv"
    path.write_bytes((data[:place] + piece + data[place + len(piece) :])[: max(cut, place)])
    try:
        table = read_table(path)
    except InputError:
        return
    assert len(table)
