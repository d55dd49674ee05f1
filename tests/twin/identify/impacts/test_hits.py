"""Which hits count: one that rebounds or saturates is set aside and named; without any left the test is refused."""

from __future__ import annotations

import pytest
from hammered import PRE, RATE_Hz, WIDTH_s, hammered, pulse

from recordings.errors import InputError
from twin.identify.impacts import sound_hits
from twin.identify.impacts.hits import pulse_of
from twin.identify.spectra.spectrum import broadband_records


def test_sound_hits_are_all_kept():
    hits = sound_hits(hammered(), force="force", channels=["v"])
    assert {point: len(own) for point, own in hits.records.items()} == {"a": 3, "b": 3, "c": 3}
    assert not hits.set_aside


def test_a_double_hit_is_set_aside_and_named():
    hits = sound_hits(hammered(rebounds=[4]), force="force", channels=["v"])
    assert len(hits.records["b"]) == 2
    (told,) = hits.set_aside
    assert told == (
        "point b, hit 2 is set aside: double hit, a second pulse of 30% lies 24.9 ms beside the first"
    )  # fmt: skip


def test_a_hit_on_the_converters_limit_is_set_aside():
    with pytest.raises(InputError, match="on the limit of its converter, 15 N"):
        sound_hits(hammered(points=1, hits=1, loud=[0]), force="force", channels=["v"])


def test_a_pulse_is_found_with_its_length():
    top, half = pulse_of(pulse(4096))
    assert top == PRE + round(WIDTH_s * RATE_Hz / 2)
    assert half >= WIDTH_s * RATE_Hz / 2


def test_hits_are_no_noise():
    with pytest.raises(InputError, match="impact test"):
        broadband_records(hammered())
