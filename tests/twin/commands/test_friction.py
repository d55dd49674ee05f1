"""`twin friction`: the friction damper's three loops through the command line, and loops that are none."""

import json
from pathlib import Path

import pytest
from said import said_beside_stages

from twin.cli import main

DATA = Path(__file__).parents[2] / "data" / "friction-damper"


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


@pytest.mark.slow
def test_three_tensions_give_one_law_whose_slip_force_rises(capsys):
    files = [DATA / f"{name}.csv" for name in ("0lb", "30lb", "36lb")]
    status, printed, _ = run(capsys, "friction", *files, "--json")
    result = json.loads(printed)
    assert status == 0
    assert result["law"] == "jenkins-with-gap"
    assert [fit["law"] for fit in result["laws"][1:]] != []
    assert min(result["r2"].values()) >= 0.97
    assert min(result["left_out_r2"].values()) >= 0.97
    assert result["slip_force_rises"]
    assert result["one_law_holds"]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("time_s,displacement_m\n" + "0,0\n" * 120, "force_N"),
        ("time_s,displacement_m,force_N\n0,0,0\n", "at least 100 rows"),
        ("time_s,displacement_m,force_N\n" + "0,0,0\n" * 120, "equal steps"),
        ("time_s,displacement_m,force_N\n" + "".join(f"{i},0,0\n" for i in range(120)) + "120,x,0\n", "line 122"),
        ("time_s,displacement_m,force_N\n" + "".join(f"{i},0,nan\n" for i in range(120)), "line 2"),
    ],
)
def test_files_that_hold_no_loop_are_refused_in_one_line(tmp_path, capsys, text, place):
    path = tmp_path / "loop.csv"
    path.write_text(text)
    status, printed, said = run(capsys, "friction", path, "--json")
    assert (status, printed) == (2, "")
    assert "loop.csv" in said
    assert place in said
    assert len(said_beside_stages(said)) == 1
