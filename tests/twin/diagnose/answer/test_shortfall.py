"""An answer says first what its model leaves unexplained, and is none where that is anything."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from twin.diagnose.answer.gain import Gain
from twin.diagnose.answer.result import Diagnosis, Misfit
from twin.diagnose.answer.shortfall import explains, shortfall, told_with
from twin.identify.residuals.error_model import SOUND

SEARCH = SimpleNamespace(model=SimpleNamespace(errors=SOUND))
AGREES = Misfit(chi2_per_dof=40.0, after=0.8, threshold=1.0, where=())


def held_out(before, after, noise_floor=0.01):
    return Gain(
        before, after, noise_floor, expected=noise_floor, in_deviations=(before / noise_floor, after / noise_floor),
        by_harmonic={}, runs=("heldout.mcap",), sweeps=(),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("before", "after", "begins"),
    [
        (0.43, 0.02, ""),
        (0.011, 0.0115, ""),  # by less than the rms is known
        (0.43, 0.04, "the held-out error of 4 % is still several times its noise, 1 %"),
        (0.02, 0.024, "the held-out error grew from 2 % to 2.4 %"),
        (0.62, 0.98, "the held-out error grew from 62 % to 98 %"),
    ],
)
@pytest.mark.parametrize("verdict", ["explained", "none"])
def test_a_gain_is_none_that_leaves_several_times_the_noise_or_grows(verdict, before, after, begins):
    left = shortfall(verdict, AGREES, held_out(before, after))
    assert left == begins
    assert explains(verdict, left) == (not begins)


@pytest.mark.parametrize("verdict", ["ambiguous", "unknown"])
def test_what_is_not_settled_is_no_answer_however_large_the_gain(verdict):
    left = shortfall(verdict, AGREES, held_out(0.43, 0.01))
    assert left == ""
    assert not explains(verdict, left)


def test_naming_nothing_beside_a_misfit_beyond_agreement_is_no_answer():
    assert shortfall("none", replace(AGREES, after=2.1), None) == (
        "chi² per degree of freedom is 2.1, where up to 1 agrees"
    )
    assert shortfall("none", AGREES, None) == ""


def test_the_first_sentence_says_so():
    assert told_with("The data name it.", "") == "The data name it."
    found = Diagnosis(
        verdict="none", misfit=AGREES, causes=(), gain=held_out(0.43, 0.43), next_test=None, seconds=1.0,
        evidence=None, search=SEARCH, sweeps=(), held_out=(),
    )  # fmt: skip
    first, second = found.sentence.split(".  ")
    assert first == "Not explained: the held-out error of 43 % is still several times its noise, 1 %"
    assert second == "No cause on the list was named."
    told = found.to_dict()
    assert (told["answer"], told["explains"]) == (found.sentence, False)
