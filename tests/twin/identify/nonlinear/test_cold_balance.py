"""A balance that is begun without any force comes to rest at every step where one of its neighbours does."""

import numpy as np
import pytest

from twin.identify.nonlinear import local_forces
from twin.identify.nonlinear.balance_kernel import NEWTON, Turn
from twin.identify.nonlinear.local_forces import LocalForces

STEPS = 7
LINE = LocalForces((), np.ones((STEPS, 2)), np.zeros(1, int))


class Ports:
    """The measured amplitude of each step."""

    amplitude = 2.0 ** np.arange(STEPS) + 0j


@pytest.fixture
def settle_near(monkeypatch):
    """Replace Newton's method by one that settles where it begins close enough to what each step comes to."""

    def given(reach, hopeless=()):
        rest, begun = np.abs(Ports.amplitude)[:, None] * np.exp([0.0, 0.3]), []

        def settle(self, ports, omega, motion, rows, now):
            for s in rows:
                begun.append(int(s))
                away = np.max(np.abs(np.log(motion[s] / rest[s])))
                now.gap[s] = 0.0 if away < reach and s not in hopeless else 1.0
                if now.gap[s, 0] == 0:
                    motion[s] = now.motion[s] = rest[s]

        monkeypatch.setattr(LocalForces, "_settle", settle)
        motion, now = np.ones((STEPS, 2), complex), Turn.of(np.ones((STEPS, 2)))
        LINE._settle(Ports, np.ones(STEPS), motion, np.arange(STEPS), now)
        assert now.settled.tolist() == [True, True] + [False] * 5
        LINE._settle_beside(Ports, np.ones(STEPS), motion, now)
        return now, motion, rest, begun

    return given


def test_a_step_goes_on_from_its_neighbour_with_the_motion_that_its_own_reading_asks_for(settle_near):
    now, motion, rest, _ = settle_near(1.0)
    assert now.settled.all()
    np.testing.assert_allclose(motion, rest)


def test_behind_a_step_without_a_balance_nothing_is_tried_for_ever(settle_near):
    now, _, _, begun = settle_near(1.0, hopeless=(4,))
    assert now.settled.tolist() == [True] * 4 + [False] * 3
    assert begun.count(4) <= 6
    assert not {5, 6} & set(begun[STEPS:])


def test_settled_is_by_the_norm_and_survives_what_is_not_a_number():
    gap = np.array([[0.9, 0.0], [0.9, 0.9], [np.nan, 0.0], [1e300, 1e300]]) * NEWTON.settled
    assert Turn(gap, gap, gap, gap).settled.tolist() == [True, False, False, False]
    assert local_forces.NEWTON is NEWTON
