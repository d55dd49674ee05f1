"""Causes' parameters are told in the units that an engineer writes them in."""

from __future__ import annotations

import pytest

from twin.diagnose.answer.parameter_text import UNITS, parameters_text, size_text
from twin.diagnose.models import CAUSES
from twin.identify.estimate import Estimate


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"mass_kg": Estimate(0.01363, 3e-5), "position_m": Estimate(0.357, 0.0007)},
         "mass 13.63 ± 0.03 g at 357.0 ± 0.7 mm"),
        ({"position_m": Estimate(0.2776, 0.0368), "stiffness_N_per_m": Estimate(239.2, 141.5)},
         "stiffness 240 ± 140 N/m at 280 ± 40 mm"),
        ({"channel": "acc1", "delay_s": Estimate(-6.346e-5, 1e-6)}, "channel acc1, delay -63.5 ± 1.0 µs"),
        ({"rate_per_s": Estimate(1.3e-7, 2e-8)}, "rate 0.047 ± 0.007 %/h"),
        ({"part": "plate", "node": Estimate(12.0, 0.0), "nodes_95": (12, 13)}, "part plate, nodes 12, 13 at node 12"),
        ({"gap_m": 5.85e-7, "position_m": 0.0}, "gap 585 nm at 0 m"),
        ({}, ""),
    ],
)  # fmt: skip
def test_a_cause_reads_as_an_engineer_would_write_it(parameters, text):
    assert parameters_text(parameters) == text


@pytest.mark.parametrize(
    ("name", "size", "text"),
    [
        ("stiffness_N_per_m", 824.0, "stiffness 820 N/m"),
        ("corner_Hz", 0.00617, "corner 6.2 mHz"),
        ("factor", 3.9e-4, "factor 0.00039"),
        ("rotational_rad_per_Nm", 1.03e-7, "rotational compliance 100 nrad/(N m)"),
        ("error_ppm", 117.0, "error 120 ppm"),
    ],
)
def test_limits_have_two_digits(name, size, text):
    assert size_text(name, size) == text


def test_every_unit_in_a_causes_parameters_is_known():
    """A name that ends with a unit nobody told of would stand in a report with its underscores' words."""
    words = {"factor", "ratio", "gradient", "carried", "node"}
    for cause in CAUSES.values():
        for parameter in getattr(cause, "numbers", ()):
            name = parameter.name
            assert name.endswith(tuple(UNITS)) or name.rpartition("_")[2] in words, (cause.name, name)
