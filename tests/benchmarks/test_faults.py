"""`twin faults` counts honestly: faults that happen are noticed, and nothing is silently wrong."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from benchmarks.fault_trials import CHANNELS
from benchmarks.faults import Row
from benchmarks.file_trials import RATE_Hz
from twin.cli import main


def test_a_fault_that_nobody_notices_and_a_false_alarm_are_not_as_it_should_be():
    row = Row(fault="f", happened=3, tried=2, noticed=2, stored=10, lost=0, most_lost=0, silently_wrong=0)
    assert row.as_it_should_be
    assert not replace(row, noticed=1).as_it_should_be
    assert not replace(row, happened=0).as_it_should_be
    assert not replace(row, silently_wrong=1).as_it_should_be


def counted(*arguments: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, dict[str, int]]]:
    with pytest.raises(SystemExit) as ended:
        main(["faults", *arguments, "--json"])
    told = json.loads(capsys.readouterr().out)
    return int(ended.value.code or 0), {row["fault"]: row for row in told["faults"]}


@pytest.mark.parametrize(
    "words", ["no fault", "flipped", "dropped", "doubled", "out of order", "stuck", "overload", "disk"]
)
def test_each_is_noticed_and_nothing_is_silently_wrong(words, capsys):
    status, rows = counted("--tries", "1", "--only", words, capsys=capsys)
    assert status == 0, rows
    assert sum(row["silently_wrong"] for row in rows.values()) == 0
    assert sum(row["stored"] for row in rows.values()) > 20_000


def test_it_is_quiet_when_told_to_be(capsys):
    with pytest.raises(SystemExit):
        main(["faults", "--tries", "1", "--only", "vanishes", "--quiet"])
    assert capsys.readouterr().err == ""


def test_a_killed_acquisition_loses_at_most_half_a_second(capsys):
    status, rows = counted("--tries", "1", "--only", "kill", capsys=capsys)
    assert status == 0
    (row,) = rows.values()
    assert row["stored"] > RATE_Hz * len(CHANNELS)
    assert row["lost"] <= 0.5 * RATE_Hz * len(CHANNELS)


@pytest.mark.nightly
def test_every_fault_many_times(capsys):
    status, rows = counted("--tries", "10", capsys=capsys)
    assert status == 0, rows
    assert rows["acquire killed (kill -9)"]["most_lost"] <= 0.5 * RATE_Hz * len(CHANNELS)
