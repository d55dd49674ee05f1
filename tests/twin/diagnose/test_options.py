"""What a diagnosis looks for and how far it goes: refused where it makes no sense, in effect where it is asked for."""

import math
import time

import pytest

import twin
from recordings import InputError
from twin.diagnose import CAUSES, DiagnosisOptions
from twin.identify.time_limit import end_of_time


def test_without_a_word_all_causes_may_be_named_and_time_has_no_end():
    options = twin.DiagnosisOptions()
    assert options.causes is CAUSES
    with options.in_effect():
        assert end_of_time() == math.inf


def test_a_cause_to_exclude_is_one_of_those_that_are_fitted():
    assert DiagnosisOptions(exclude=["added-mass"]).exclude == ["added-mass"]
    for options in ({"exclude": ["gremlin"]}, {"exclude": ["added-mass"], "causes": {}}):
        with pytest.raises(InputError, match="is no cause that is fitted"):
            DiagnosisOptions(**options)


def test_the_time_limit_counts_from_where_the_options_take_effect():
    options = DiagnosisOptions(time_limit_s=60.0)
    begun = time.monotonic()
    with options.in_effect():
        assert end_of_time() == pytest.approx(begun + 60.0, abs=5.0)
    assert end_of_time() == math.inf
