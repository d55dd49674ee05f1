"""Which rivals begin beside no law, by how exact the likeliest fit so far is."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from twin.diagnose.selection import rivals
from twin.diagnose.selection.racing import USUAL
from twin.identify.residuals.error_model import SOUND

NOISY = replace(SOUND, broadband=replace(SOUND.broadband, ratio=10 * SOUND.broadband.ratio))
NAMES = ("mass", "gain", "slider")


def hypothesis(name):
    return SimpleNamespace(cause=SimpleNamespace(name=name, tried_at_full_size=name == "slider"), key=name)


def fit(name, log_evidence, errors, settled=True):
    solution = SimpleNamespace(settled=settled)
    return SimpleNamespace(hypotheses=(hypothesis(name),), log_evidence=log_evidence, errors=errors, solution=solution)


@pytest.fixture
def begun_of(monkeypatch):
    """Runs the rivals of a mass and a gain that were fitted; gives what begins beside no law, and what leads then."""

    def run(first, slider):
        scores = [SimpleNamespace(hypothesis=hypothesis(name), if_sound=None) for name in NAMES]
        begun_so_far = []

        def beside_no_law(race, model, hypotheses, report):
            begun_so_far.extend(each.key for each in hypotheses)
            return [fit(each.key, 9.0, slider) for each in hypotheses if each.key == "slider"]

        monkeypatch.setattr(rivals, "_promising", lambda *_: scores[:2])
        monkeypatch.setattr(rivals, "_beside_the_law", lambda *_: None)
        monkeypatch.setattr(rivals, "_raced", lambda *_: list(first))
        monkeypatch.setattr(rivals, "_raced_beside_no_law", beside_no_law)
        monkeypatch.setattr(rivals, "once_more", lambda *_: [])
        monkeypatch.setattr(rivals, "log_weight", lambda _, each: each.log_evidence)
        race = SimpleNamespace(evidence=SimpleNamespace(), effort=USUAL, harmonics=None, tolerances=None)
        race.with_best_threshold = lambda _: []
        return begun_so_far, rivals.fitted_rivals(race, None, None, scores, print)[0].hypotheses[-1].key

    return run


@pytest.mark.parametrize(
    ("errors", "slider", "begun"),
    [
        ((SOUND, SOUND), SOUND, []),
        ((SOUND, NOISY), SOUND, []),  # a less likely one needs more
        ((NOISY, SOUND), SOUND, ["slider"]),
        ((NOISY, NOISY), NOISY, ["slider", "mass", "gain"]),
    ],
)
def test_what_a_law_imitates_is_tried_where_the_likeliest_errs_in_any_data(begun_of, errors, slider, begun):
    """The slider's score promised too little to be among those that are fitted beside the law."""
    begun_so_far, leading = begun_of((fit("mass", 2.0, errors[0]), fit("gain", 1.0, errors[1])), slider)
    assert begun_so_far == begun
    assert leading == ("slider" if begun else "mass")


@pytest.mark.parametrize(("slider", "begun"), [(SOUND, ["mass", "slider"]), (NOISY, ["mass", "slider", "gain"])])
def test_a_leading_one_that_has_not_settled_begins_anew_once_however_much_it_errs(begun_of, slider, begun):
    """A soft joint ended at its first fit's last iteration, and was given up for what the law imitates."""
    first = fit("mass", 2.0, NOISY, settled=False), fit("gain", 1.0, NOISY)
    assert begun_of(first, slider)[0] == begun
