"""The table of quantities, and one from outside."""

from __future__ import annotations

import pytest

from recordings import quantities
from recordings.container.metadata import channel_record, parse_channel
from recordings.errors import InputError
from recordings.quantities import (
    QUANTITIES,
    Quantity,
    follows_excitation,
    is_motion,
    is_response,
    known_quantities,
    quantity,
    quantity_of_code,
    quantity_of_unit,
)
from recordings.run import Channel


class Installed:
    """An entry point."""

    value = "elsewhere:WHAT"

    def __init__(self, what):
        self._what = what

    def load(self):
        return self._what


@pytest.fixture
def install(monkeypatch):
    def installed(*what):
        monkeypatch.setattr(
            quantities, "entry_points", lambda group: [Installed(one) for one in what] if "quantities" in group else []
        )
        monkeypatch.setattr(quantities, "known_quantities", known_quantities.__wrapped__)
        return quantities.known_quantities()

    return installed


def test_names_and_codes_are_all_different_and_codes_are_for_ever():
    """A recording or a node of last year must mean the same today."""
    assert [one.name for one in QUANTITIES][:8] == [
        "force", "acceleration", "velocity", "displacement", "voltage", "current", "temperature", "preload",
    ]  # fmt: skip
    assert [one.code for one in QUANTITIES] == list(range(len(QUANTITIES)))


def test_labels_of_units_mean_one_quantity():
    spelt = [label for one in QUANTITIES for label in one.spellings]
    assert len(set(spelt)) == len(spelt)
    assert {label for label in spelt if label != label.lower()} == {"mN", "MN"}
    assert quantity_of_unit("m_per_s2") == quantity_of_unit("M/S²") == ("acceleration", 1.0)
    assert quantity_of_unit("µm/m") == ("strain", 1e-6)
    assert quantity_of_unit(" G ") == ("acceleration", 9.80665)
    assert quantity_of_unit("N") == ("force", 1.0)
    assert quantity_of_unit("Pa") is None


def test_what_follows_the_excitation():
    assert [one.name for one in QUANTITIES if follows_excitation(one.name)] == [
        "force", "acceleration", "velocity", "displacement", "strain",
    ]  # fmt: skip
    assert is_response("strain")
    assert not is_motion("strain")
    assert is_motion("velocity")
    assert not follows_excitation("unknown")
    derived = {name: quantity(name).derivative for name in ("displacement", "velocity", "acceleration", "strain")}
    assert derived == {"displacement": 0, "velocity": 1, "acceleration": 2, "strain": 0}


def test_a_channel_of_strain_is_recorded_with_its_unit():
    gauge = Channel(name="gauge", quantity="strain", unit="m/m", position_m=0.02, range=2e-3)
    assert parse_channel("gauge", channel_record(gauge)) == gauge
    with pytest.raises(ValueError, match="unit of strain is 'm', not 'm/m'"):
        parse_channel("gauge", {"quantity": "strain", "unit": "m", "device": "daq"})


def test_a_package_may_bring_a_quantity(install):
    rate = Quantity(name="strain-rate", unit="1/s", code=130, reads="strain", derivative=1)
    assert "strain-rate" in install(rate)
    assert quantity_of_code(130) == "strain-rate"
    assert parse_channel("r", {"quantity": "strain-rate", "unit": "1/s", "device": "daq"}).quantity == "strain-rate"


@pytest.mark.parametrize(
    "what",
    [
        "no quantity",
        Quantity(name="force", unit="N", code=130),
        Quantity(name="jerk", unit="m/s^3", code=2),
        Quantity(name="jerk", unit="m/s^3", code=255),
        Quantity(name="jerk", unit="m/s^3", code=130, reads="displacement", derivative=3),
    ],
)
def test_a_package_may_not_take_what_is_taken(install, what):
    with pytest.raises(InputError, match=r"elsewhere:WHAT: twin\.quantities"):
        install(what)
