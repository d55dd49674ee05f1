"""The benchmarks compare like with like: both sides give the same answer, whatever time they take."""

import pytest

from twin.commands.speed import balance, equivalent_linear_sweep, receptances


@pytest.mark.parametrize(
    ("benchmark", "error"),
    [
        (equivalent_linear_sweep, 1e-4),
        (receptances, 1e-10),
        (balance, 1e-10),
    ],
)
def test_both_sides_agree(benchmark, error):
    """The banded full model has all modes; ours eighteen, damped, and the rest as statics."""
    row = benchmark()
    assert 0 <= row["error"] < error
    assert row["ratio"] > 0
