"""The pages of causes say what the causes are, and show a case of this version."""

from importlib.metadata import version
from pathlib import Path

import cause_cases
import make_causes
import pytest

from twin.cause_registry import NAMES, advice_on

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_the_scripts():
    assert (DOCS / "causes.md").read_text(encoding="utf-8") == make_causes.table(), "python docs/make_causes.py"


def test_every_cause_of_the_contract_has_its_row():
    rows = dict(line.split(" | ")[:2] for line in make_causes.table().splitlines() if line.startswith("| [`"))
    assert set(rows) == {f"| [`{name}`](causes/{name}.md)" for name in NAMES}
    assert rows["| [`attached-resonator`](causes/attached-resonator.md)"] == (
        "place, `mass_kg`, `frequency_Hz`, `damping_ratio`"
    )
    assert rows["| [`joint-friction`](causes/joint-friction.md)"] == (
        "`stiffness_N_per_m`, `slip_force_N`, [`layer_element`], [`joint`]"
    )


@pytest.mark.parametrize("cause", NAMES)
def test_the_page_of_a_cause_shows_its_case_of_this_version(cause):
    page = (DOCS / "causes" / f"{cause}.md").read_text(encoding="utf-8")
    case = cause_cases.kept(cause)
    assert page == make_causes.page(cause, case), "python docs/make_causes.py"
    assert case["version"] == version("virtual-test-rig")
    assert case["verdict"]
    assert case["answer"]
    hidden, drawn = case["hidden"], cause_cases.drawn(cause).effects[0].parameters
    assert list(hidden) == list(drawn), "python docs/cause_cases.py"
    for name, value in drawn.items():  # another processor sums a structure's parts with other last bits
        same = value if isinstance(value, str) else pytest.approx(value, rel=1e-12)
        assert hidden[name] == same, "python docs/cause_cases.py"
    assert (DOCS / "causes" / f"{cause}.png").read_bytes().startswith(b"\x89PNG")
    advice = advice_on(cause)
    assert advice is not None
    for told in (advice.looks_like, advice.tell_apart, advice.on_the_rig):
        assert len(told) > 40
        assert told.endswith(".")
        assert told in page
    assert advice.page == f"docs/causes/{cause}.md"


def test_a_cause_from_outside_has_no_advice():
    assert advice_on("gremlins") is None


@pytest.mark.slow
def test_a_case_is_what_its_rig_gives(tmp_path):
    """Of a wrong gain: the picture and the diagnosis are made as they were, but for times and last digits."""
    case = cause_cases.drawn("channel-gain")
    told = cause_cases.diagnosed(cause_cases.recorded(case, tmp_path))
    assert told["verdict"] == "explained"
    assert told["answer"].startswith("The data name channel-gain")
    assert max(told["scored"], key=told["scored"].get) == "channel-gain"
