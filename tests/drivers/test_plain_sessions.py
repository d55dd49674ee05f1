"""A person at a terminal: socat and nothing else, on a pseudo-terminal and over TCP."""

from __future__ import annotations

import subprocess

import pytest
from needed import needs, program
from virtual_rig import FilteredSine, served

pytestmark = needs("socat")
TYPED = """*IDN?
*CLS
FREQ 25.3 HZ;VOLT 500 MV
FREQ?;VOLT?
BREAKFAST
SYST:ERR?
*ESR?
SYST:ERR?
"""


def session(where: str, typed: bytes, lines: int) -> list[str]:
    """So many lines of answers; neither end of such a line tells when it has said all."""
    with subprocess.Popen([program("socat"), "-", where], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as socat:
        assert socat.stdin is not None
        assert socat.stdout is not None
        socat.stdin.write(typed)
        socat.stdin.flush()
        answers = [socat.stdout.readline().decode().rstrip("\r\n") for _ in range(lines)]
        socat.kill()
    return answers


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["lf", "crlf", "cr"])
@pytest.mark.parametrize("kind", ["serial", "tcp"])
def test_a_typed_session(kind, end):
    with served(FilteredSine(), meter="auto", **{kind: True}) as rig:
        where = f"TCP:{rig.tcp}" if rig.tcp else f"{rig.serial},rawer"
        answers = session(where, TYPED.replace("\n", end).encode(), 5)
        (preload,) = session(f"{str(rig.meter).partition(':')[2]},rawer", f"MEAS:PREL?{end}".encode(), 1)
    assert answers == [
        "Virtual Test Rig,DAQ-GEN,simulated,1.0",
        "25.3;0.5",
        '-113,"Undefined header;BREAKFAST"',
        "32",
        '0,"No error"',
    ]
    assert float(preload) == pytest.approx(540.0, abs=0.2)


def test_a_block_has_the_length_it_says():
    with (
        served(FilteredSine(), tcp=True) as rig,
        subprocess.Popen(
            [program("socat"), "-", f"TCP:{rig.tcp}"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as line,
    ):
        assert line.stdin is not None
        assert line.stdout is not None
        line.stdin.write(b"READ? 100\n")
        line.stdin.flush()
        assert line.stdout.read(6) == b"#41200"
        assert line.stdout.read(1201) == rig.source.everything[:, :100].tobytes() + b"\n"
        line.kill()
