"""A diagnosis says what to do on the rig, and names a page that is there."""

from pathlib import Path

from twin.diagnose import NamedCause

ROOT = Path(__file__).parents[3]


def named(cause: str) -> NamedCause:
    return NamedCause(cause=cause, summary="", probability=1.0, confused_with=(), parameters={}, in_model=True)


def test_a_named_cause_leads_to_its_page():
    advice = named("added-mass").advice
    assert advice.startswith("Look for what was left on")
    page = advice.rpartition("More in ")[2].rstrip(".")
    assert (ROOT / page).is_file()


def test_a_cause_of_ones_own_has_none():
    assert named("gremlins").advice == ""
