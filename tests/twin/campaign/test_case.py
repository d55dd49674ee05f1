"""One case: every diagnosis of it ends at its time limit."""

from types import SimpleNamespace

from twin.campaign import CasePlan, case
from twin.rigs import load_rig

FOUND = {"next_test": None, "gain": {"held_out": {"after": 0.01}}, "causes": []}


def test_each_diagnosis_of_a_case_has_the_time_that_is_allowed(tmp_path, monkeypatch):
    """The blind one, and the one that may name what is hidden alone."""
    asked = []

    def diagnose(learn, rig, *, held_out, out, options):
        asked.append((len(options.causes) > 1, options.time_limit_s))
        return SimpleNamespace(to_dict=lambda: FOUND)

    monkeypatch.setattr(case, "diagnose", diagnose)
    monkeypatch.setattr(case, "record_case", lambda plan, rig, folder: (SimpleNamespace(effects=[]), []))
    monkeypatch.setattr(case, "read_run", lambda path: SimpleNamespace(devices={}))
    plan = CasePlan(1, ("added-mass",))
    result = case.run_case(plan, load_rig("steel-lap-joint"), tmp_path, time_limit_s=50.0)
    assert result.error == ""
    assert asked == [(True, 50.0), (False, 50.0)]
