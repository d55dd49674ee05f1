"""A value is told to the digits that its standard deviation supports."""

from __future__ import annotations

import pytest

from twin.identify.estimate import Estimate


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.0080087, 7.9e-6, "0.008009 ± 0.000008"),
        (0.35, 0.012, "0.350 ± 0.012"),
        (13.63, 0.0301, "13.63 ± 0.03"),
        (239.2, 141.5, "240 ± 140"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (3.95e8, 7.4e5, "3.950e+08 ± 7e+05"),
        (5e-9, 3e-9, "5e-09 ± 3e-09"),
        (1.5, float("inf"), "1.5"),
        (1.5, 0.0, "1.5"),
    ],
)
def test_values_have_the_digits_their_deviation_supports(value: float, std: float, text: str) -> None:
    assert str(Estimate(value, std)) == text


def test_a_change_shows_its_sign():
    assert [f"{Estimate(change, 0.02):+}" for change in (0.31, 0.0, -0.31)] == [
        "+0.31 ± 0.02", "+0.00 ± 0.02", "-0.31 ± 0.02",
    ]  # fmt: skip


def test_it_is_as_wide_as_a_text_of_a_table():
    assert f"{Estimate(0.31, 0.02):>14}|{Estimate(0.31, 0.02):+<14}|" == "   0.31 ± 0.02|+0.31 ± 0.02  |"
