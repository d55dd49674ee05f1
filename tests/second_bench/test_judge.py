"""The judge's reading of an answer."""

import json

import pytest

from tests.second_bench import judge

ANSWER = {
    "verdict": "explained",
    "set_95": ["added-mass"],
    "causes": [
        {
            "cause": "added-mass", "probability": 0.98, "in_model": True,
            "parameters": {"mass_kg": {"value": 0.011, "std": 0.0005}, "position_m": {"value": 0.30, "std": 0.01}},
        }
    ],
    "gain": {"held_out": {"before": 0.08, "after": 0.006, "noise_floor": 0.004}},
    "misfit": {"chi2_per_dof": 3.0},
    "model_error": {"inferred": 1e-6},
}  # fmt: skip


def case(folder, name="added-mass-1"):
    (folder / name).mkdir()
    truth = {"cause": "added-mass", "parameters": {"mass_kg": 0.010, "position_m": 0.31}, "modes": 1}
    (folder / name / "truth.json").write_text(json.dumps(truth))
    return folder / name


def test_pulls_are_errors_in_standard_deviations(tmp_path, monkeypatch):
    monkeypatch.setattr(judge, "diagnosed", lambda folder, limit_s: (ANSWER, ""))
    entry = judge.judged(case(tmp_path), limit_s=1.0)
    assert entry["pulls"] == pytest.approx({"mass_kg": 2.0, "position_m": -1.0})
    assert entry["p(truth)"] == 0.98
    assert "mass_kg 2.0, position_m -1.0" in judge.table([entry])


def test_a_name_is_right_or_wrong():
    cause = {"parameters": {"channel": "acc1", "factor": {"value": 1.05, "std": 0.01}}}
    assert judge.pulls({"channel": "acc2", "factor": 1.04}, cause) == pytest.approx({"channel": False, "factor": 1.0})


def test_no_answer_is_told_as_such(tmp_path, monkeypatch):
    monkeypatch.setattr(judge, "diagnosed", lambda folder, limit_s: (None, "no answer in 1 s"))
    assert "no answer in 1 s" in judge.table([judge.judged(case(tmp_path), limit_s=1.0)])


def test_cases_are_found_in_folders_and_by_name(tmp_path):
    one, two = case(tmp_path, "b"), case(tmp_path, "a")
    assert judge.cases_in([tmp_path]) == judge.cases_in([one, two]) == [two, one]


def test_a_diagnosis_ends_at_its_limit_of_cpu_time(tmp_path, monkeypatch):
    endless = tmp_path / "endless"
    endless.write_text("#!/bin/sh\nwhile :; do :; done\n")
    endless.chmod(0o755)
    monkeypatch.setattr(judge.sys, "executable", str(endless))
    found, trouble = judge.diagnosed(case(tmp_path), limit_s=0.5)
    assert (found, trouble) == (None, "no answer in 1 s")


def test_what_the_tool_says_is_told_where_it_has_no_answer(tmp_path):
    found, trouble = judge.diagnosed(case(tmp_path), limit_s=60)
    assert found is None
    assert "rig.toml" in trouble
