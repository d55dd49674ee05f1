"""The same rehearsal twice gives the same files, byte by byte."""

from __future__ import annotations

from pathlib import Path

import pytest
from two_steps import TWO_STEPS

from twin.cli import main


def test_the_same_rehearsal_gives_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "sweep.toml").write_text(TWO_STEPS)
    arguments = ["rehearse", str(tmp_path / "sweep.toml"), "--rig", "steel-lap-joint", "--rounds", "1"]
    found = []
    for _ in range(2):
        with pytest.raises(SystemExit) as ended:
            main([*arguments, "--out", str(tmp_path / "out"), "--overwrite", "--quiet"])
        assert ended.value.code == 0
        found.append({path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()})
    assert {"run.mcap", "report.html", "result.json", "procedure.toml"} <= set(found[0])
    assert found[0] == found[1]
