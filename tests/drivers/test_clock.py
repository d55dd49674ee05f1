"""Two clocks brought together by pulses that both have stamped."""

import numpy as np
import pytest

from drivers.host.clock import ClockFit, TimeLine


def test_offset_and_drift_are_found_to_a_tenth_of_a_degree_at_1_kHz():
    fit = ClockFit()
    generator = np.random.default_rng(4)
    for pulse in range(200):
        reference = pulse * 100_000_000
        jitter = int(generator.normal(0, 100))  # a stamp is good to 0.1 us
        local = round(reference * (1 + 35e-6)) + 7_000_000_000 + jitter
        fit.add_reference(pulse, reference)
        if pulse % 7:  # some are lost on the way
            fit.add_local(pulse, local)
    assert fit.drift_ppm == pytest.approx(-35, abs=0.05)
    for reference in (19_000_000_000, 20_000_000_000):
        local = round(reference * (1 + 35e-6)) + 7_000_000_000
        error_degrees = 360 * 1000 * 1e-9 * (fit.to_reference(local) - reference)
        assert abs(error_degrees) < 0.1


def test_equal_clocks_stay_equal_to_the_nanosecond():
    fit = ClockFit()
    for pulse in range(50):
        fit.add_local(pulse, pulse * 100_000_007)
        fit.add_reference(pulse, pulse * 100_000_007)
    assert fit.to_reference(123_456_789_012_345) == 123_456_789_012_345


def test_pulses_of_one_side_alone_do_not_pile_up():
    fit = ClockFit()
    for pulse in range(100_000):
        fit.add_reference(pulse, pulse)
    assert len(fit._reference) <= 600
    assert not fit.synchronised


def test_times_are_counted_from_the_stamp_before():
    line = TimeLine()
    line.add(0, 1000)
    assert line.time_ns(50, 1e3) == 50_001_000
    line.add(100, 100_001_001)  # a rounded stamp says nothing of the rate
    assert line.time_ns(50, 1e3) == 50_001_000
    line.add(200, 200_004_001)  # 30 ppm: the stamping clock is not the sampling one
    assert line.time_ns(150, 1e3) == 150_002_501
    assert line.time_ns(300, 1e3) == 300_007_001
    line.forget_before(200)
    assert line.time_ns(300, 1e3) == 300_007_001
