"""A campaign goes on where it ended, on this machine's cores or on a cluster."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from needed import package

from recordings.errors import InputError
from twin.campaign import CasePlan, CaseResult, read_results, run_campaign, runner
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")
PLANS = [CasePlan(seed, ("added-mass",)) for seed in (1, 2, 3)]


def quick_case(plan, rig, keep=None, **options):
    """Stands for a minute's work."""
    error = "ValueError: bad luck" if plan.seed == 2 else ""
    return CaseResult(plan=plan, rig=rig.name, hidden=[], found=None, aborted=[], recording_s=0.0, error=error)


def test_finished_cases_are_not_run_again_and_failed_ones_are(tmp_path, monkeypatch):
    from concurrent.futures import ThreadPoolExecutor
    from contextlib import contextmanager

    ran = []

    @contextmanager
    def in_threads(workers, most):
        with ThreadPoolExecutor(workers) as executor:
            yield executor

    def counted(plan, rig, keep, **options):
        ran.append(plan.seed)
        return quick_case(plan, rig)

    monkeypatch.setattr(runner, "_executor", in_threads)
    monkeypatch.setattr(runner, "run_case", counted)
    run_campaign(PLANS[:2], RIG, tmp_path)
    assert sorted(ran) == [1, 2]
    seen = []
    results = run_campaign(PLANS, RIG, tmp_path, on_result=lambda result: seen.append(result.plan.seed))
    assert sorted(ran) == [1, 2, 2, 3]
    assert sorted(seen) == [1, 2, 3]
    assert [result.plan for result in results] == PLANS
    assert read_results(tmp_path) == results


def test_cases_of_another_rig_are_refused(tmp_path):
    runner._write(CaseResult(plan=PLANS[0], rig="mine", hidden=[], found=None, aborted=[], recording_s=0.0),
                  _with_cases(tmp_path))  # fmt: skip
    with pytest.raises(InputError, match="holds cases of the rig mine"):
        run_campaign(PLANS, RIG, tmp_path)


@pytest.mark.parametrize("text", ["", "[]", "{}", json.dumps({"plan": 3}), '{"plan": {"seed": 1}}', "[" * 200_000])
def test_a_damaged_case_is_named(tmp_path, text):
    (_with_cases(tmp_path) / "cases" / "added-mass-1-1.json").write_text(text)
    with pytest.raises(InputError, match=r"added-mass-1-1\.json.*delete it"):
        read_results(tmp_path)


# A busy machine's disk is no matter of this test's.
@pytest.mark.filterwarnings("ignore:Creating scratch directories")
def test_a_dask_cluster_runs_the_cases(tmp_path, monkeypatch):
    distributed = package("distributed")
    monkeypatch.setattr(runner, "run_case", quick_case)
    options = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": None}
    options["local_directory"] = str(tmp_path / "scratch")
    with distributed.LocalCluster(protocol="tcp", host="127.0.0.1", **options) as cluster:
        results = run_campaign(PLANS, RIG, tmp_path, workers=cluster.scheduler_address)
    assert [result.plan for result in results] == PLANS
    assert [bool(result.error) for result in results] == [False, True, False]


def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "LIMITS", replace(runner.LIMITS, scheduler_s=0.5))
    package("distributed")
    with pytest.raises(InputError, match=r"--scheduler.*cannot be reached"):
        run_campaign(PLANS, RIG, tmp_path, workers="tcp://127.0.0.1:1")


def _with_cases(folder):
    (folder / "cases").mkdir()
    return folder
