"""The same rehearsal twice gives the same files, byte by byte."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.cli import main

PROCEDURE = """
procedure = "stepped-sine"
target_channel = "force"
control = "force"
amplitudes = [1.5]
sample_rate = 1024.0
[grid]
start = 40.0
stop = 41.0
step = 1.0
[settle]
tolerance = 0.01
maximum = 30.0
[measure]
seconds = 0.5
[limits]
voltage = 10.0
"""


def test_the_same_rehearsal_gives_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "sweep.toml").write_text(PROCEDURE)
    arguments = ["rehearse", str(tmp_path / "sweep.toml"), "--rig", "steel-lap-joint", "--rounds", "1"]
    found = []
    for _ in range(2):
        with pytest.raises(SystemExit) as ended:
            main([*arguments, "--out", str(tmp_path / "out"), "--overwrite", "--quiet"])
        assert ended.value.code == 0
        found.append({path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()})
    assert {"run.mcap", "report.html", "result.json", "procedure.toml"} <= set(found[0])
    assert found[0] == found[1]
