"""Frequencies of several resonances are told apart by the gap between them."""

import numpy as np

from twin.identify.spectra.resonances import by_resonance


def test_sweeps_of_two_modes_are_two_groups_in_their_own_order():
    groups = by_resonance(np.array([160.0, 26.0, 158.0, 26.5, 25.5]))
    assert [group.tolist() for group in groups] == [[1, 3, 4], [0, 2]]


def test_a_wide_sweep_without_a_gap_is_one_group_and_nothing_is_none():
    assert len(by_resonance(np.geomspace(10.0, 500.0, 40))) == 1
    assert by_resonance(np.zeros(0)) == []
