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


def fit(name, log_evidence, errors):
    return SimpleNamespace(hypotheses=(hypothesis(name),), log_evidence=log_evidence, errors=errors)


@pytest.fixture
def begun_of(monkeypatch):
    """Runs the rivals of a mass and a gain that were fitted; gives what begins beside no law, and what leads then."""

    def run(first, slider, *, without=0.0, if_sound=()):
        scores, asked = (
            [SimpleNamespace(hypothesis=hypothesis(name)) for name in names] for names in (NAMES, if_sound)
        )
        begun_so_far = []

        def raced(race, model, beside, anew, report):
            begun_so_far.extend(each.key for each in anew)
            named = {score.hypothesis.key for score in beside}
            with_law = [each for each in first if each.hypotheses[-1].key in named]
            return with_law + [fit(each.key, 9.0, slider) for each in anew if each.key == "slider"]

        monkeypatch.setattr(rivals, "_promising", lambda _, each, __: each if each is not scores else scores[:2])
        monkeypatch.setattr(rivals, "_raced", raced)
        monkeypatch.setattr(rivals, "log_weight", lambda _, each: each.log_evidence)
        race = SimpleNamespace(evidence=SimpleNamespace(), effort=USUAL, harmonics=None, tolerances=None)
        return begun_so_far, rivals.fitted_rivals(
            race, None, fit("none", without, NOISY), scores, lambda: asked, print
        )[0].hypotheses[-1].key

    return run


@pytest.mark.parametrize(
    ("errors", "slider", "begun"),
    [
        ((SOUND, SOUND), SOUND, []),
        ((SOUND, NOISY), SOUND, []),  # a less likely one needs more
        ((NOISY, SOUND), SOUND, ["slider"]),
        ((NOISY, NOISY), NOISY, ["slider"]),
    ],
)
def test_what_a_law_imitates_is_tried_where_the_likeliest_errs_in_any_data(begun_of, errors, slider, begun):
    """The slider's score promised too little to be among those that are fitted beside the law."""
    begun_so_far, leading = begun_of((fit("mass", 2.0, errors[0]), fit("gain", 1.0, errors[1])), slider)
    assert begun_so_far == begun
    assert leading == ("slider" if begun else "mass")


def test_a_leading_one_that_explains_less_than_the_model_it_contains_begins_anew(begun_of):
    """A soft joint's first fit led astray, and was given up for what the law imitates."""
    first = fit("mass", 2.0, SOUND), fit("gain", 1.0, SOUND)
    assert begun_of(first, SOUND, without=3.0)[0] == ["mass"]


def test_what_a_sound_rigs_errors_ask_for_is_fitted_where_no_other_is_exact(begun_of):
    """A cubic spring, which the law imitates with large errors: beside these it promised less than nothing."""
    first = fit("mass", 2.0, NOISY), fit("gain", 1.0, NOISY), fit("slider", 3.0, SOUND)
    begun_so_far, leading = begun_of(first, SOUND, if_sound=["slider"])
    assert leading == "slider"
    assert begun_of((fit("mass", 2.0, SOUND), *first[1:]), SOUND, if_sound=["slider"])[1] == "mass"
    assert begun_so_far == ["slider"]


def test_beginnings_beside_the_law_and_beside_none_run_one_race(monkeypatch):
    """A slider's fit beside the law took minutes to end before the one beside no law left it far behind."""
    ran = []
    race = SimpleNamespace(evidence=None, harmonics=None, run=lambda begun: ran.append(begun) or begun)
    monkeypatch.setattr(rivals, "_beside_the_law", lambda _, __, score: f"{score.hypothesis.key} beside the law")
    monkeypatch.setattr(rivals, "_at_full_size", lambda _, each: each)
    monkeypatch.setattr(rivals, "parallel_map", lambda _, __, work: [f"{each.key} beside no law" for (each,) in work])
    told = []
    rivals._raced(race, None, [SimpleNamespace(hypothesis=hypothesis("slider"))], [hypothesis("slider")], told.append)
    assert ran == [["slider beside the law", "slider beside no law"]]
    assert told == ["fitting slider"]
