"""The measured figures are those of one code: what was not run, failed or is of another commit is told as that."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import asdict
from pathlib import Path

import click
import measure
import pytest
from measured_stages import STAGES, Stage

from twin.cli import group

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def answer(code: str = "abc1234", failure: str = "", **values: object) -> measure.Answer:
    return measure.Answer(
        code=code, machine="a machine", date="2026-01-02", seconds=3.0, load=0.5, answer=values, failure=failure
    )


def friction() -> measure.Answer:
    return answer(
        law="jenkins", slip_force_N={"0lb": {"value": 2500.0, "std": 10.0}}, r2={"0lb": 0.99}, left_out_r2={"0lb": 0.98}
    )


@pytest.mark.parametrize("name", STAGES)
def test_every_stage_is_a_command_line_that_is_understood(name):
    first, *words = shlex.split(STAGES[name].command)
    command = group.get_command(click.Context(group), first)
    command.make_context(first, words, resilient_parsing=True)
    for word in words:
        assert not word.startswith("tests/") or (measure.ROOT / word).exists()


def test_page_and_readme_tell_an_answer_and_what_was_not_run():
    page = measure.page({"friction-damper": friction()}, "abc1234")
    assert "commit abc1234" in page
    assert "| 0lb | jenkins | 2500 ± 10 | 0.99 | 0.98 |" in page
    assert page.count(": not run (`python docs/measure.py --only ") == len(STAGES) - 1
    lines = measure.readme_lines({"friction-damper": friction()}, "abc1234").splitlines()
    assert len(lines) == 2 + 10
    assert sum("| not run |" in line for line in lines) == 9
    assert sum("slip force 2.5 kN" in line for line in lines) == 1


def test_a_failure_is_told_in_place_of_figures():
    page = measure.page({"friction-damper": answer(failure="ended with status 2: no such file")}, "abc1234")
    assert "load 0.5; failed: ended with status 2: no such file." in page
    assert "slip force" not in page


def test_answers_of_another_code_are_not_told(tmp_path):
    for name, code in (("friction-damper", "abc1234"), ("demo", "0ther00")):
        (tmp_path / f"{name}.json").write_text(json.dumps(asdict(answer(code))))
    assert list(measure.kept(tmp_path, "abc1234")) == ["friction-damper"]


def test_only_what_stands_between_the_marks_is_written():
    text = f"before\n{measure.BEGIN}\nold\n{measure.END}\nafter\n"
    written = measure.between_marks(text, "new")
    assert written == f"before\n{measure.BEGIN}\n\nnew\n\n{measure.END}\nafter\n"
    assert measure.between_marks(written, "new") == written
    with pytest.raises(ValueError, match="needs the marks"):
        measure.between_marks("no marks", "new")
    assert measure.between_marks(README, "new").count(measure.BEGIN) == 1


def test_a_command_is_run_and_one_that_says_no_json_fails():
    ran = measure.run(Stage(title="a beam", command="reproduce composite-beam --frequencies-only", table=list))
    assert not ran.failure
    assert STAGES["composite-beam"].line(ran.answer).startswith("worst ")
    assert len(STAGES["composite-beam"].table(ran.answer)) == 2
    wrong = measure.run(Stage(title="nothing", command="reproduce no-such-paper", table=list))
    assert wrong.failure.startswith("ended with status 2: ")


def test_links_of_the_readme_lead_somewhere():
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", README):
        assert (measure.ROOT / target).exists(), target
