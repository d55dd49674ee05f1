"""An answer that blames or leaves something says what a first look suspected; one that has nothing to say does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from twin.checks import Finding
from twin.lab.diagnosed import DiagnosedRecordings

FINDING = Finding("noise.mcap", "", "preload", "those of 540N", "it has the resonances of 120N", "told")


@pytest.mark.parametrize(
    ("verdict", "shortfall", "told"), [("none", "", 0), ("none", "held-out error", 1), ("explained", "", 1)]
)
def test_what_was_suspected_is_said_once(verdict: str, shortfall: str, told: int) -> None:
    diagnosis: Any = SimpleNamespace(verdict=verdict, shortfall=shortfall, sentence="It is so.")
    sentence = DiagnosedRecordings(diagnosis, (FINDING, FINDING)).sentence
    assert sentence.startswith("It is so.")
    assert sentence.count("At first look: noise.mcap: preload: it has the resonances of 120N") == told
