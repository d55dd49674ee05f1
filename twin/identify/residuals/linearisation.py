"""What a fit holds while its parameters move: weights, the balance of fundamentals, what harmonics add to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.nonlinear.balance import Balance
from twin.identify.nonlinear.opening_harmonics import OpeningBalance, Openings
from twin.identify.residuals.error_model import ErrorSources
from twin.identify.residuals.whitening import Whitening


@dataclass(frozen=True)
class LostContact:
    """A layer's openings where they lose contact."""

    openings: Openings
    """What surrounds them at all harmonics."""
    balance: OpeningBalance
    """Those harmonics."""
    read: Array
    """What the channels read per force on the openings, (s, h, o, p)."""


@dataclass(frozen=True)
class Linearisation:
    """What a fit holds while its parameters move; it would creep if these moved with them."""

    broadband: tuple[Whitening, ...]
    """Of each broadband run's log responses, (b, o, o)."""
    steps: Whitening
    """Of the steps, real parts above imaginary ones, (s, 2 o, 2 o)."""
    balance: Balance | None
    """Of the moving ports: where to begin, and what harmonics add."""
    lost: LostContact | None
    """The layer's openings, where contact is lost there."""
    baseline: BaselineParameters
    """That the balance was found with."""
    by_unknowns: Array | None
    """Derivative by each unknown of what the harmonics add at the points, (s, 2 p, u)."""
    made_of: ErrorSources | None = None
    """What the covariances came from; none where they were given."""
    harmonics: Whitening | None = None
    """Of the higher harmonics, where these are data, too, (s, h, o, o)."""

    def weighted_as(self, other: Linearisation) -> Linearisation:
        """The same with another's weights."""
        return replace(self, broadband=other.broadband, steps=other.steps, harmonics=other.harmonics)

    def adding(self, more: Array) -> Linearisation:
        """The same where harmonics add so much more (s, n) to the stiffness of the first ports."""
        assert self.balance is not None
        return replace(self, balance=with_more(self.balance, more))

    def derivative(self, baseline: BaselineParameters) -> Array | None:
        """Where there are :attr:`by_unknowns`, and by these parameters: laws have knots of their own."""
        same = all(
            np.array_equal(law.opening_knots, mine.opening_knots) and np.array_equal(law.slip_knots, mine.slip_knots)
            for law, mine in zip(baseline.laws, self.baseline.laws, strict=True)
        )
        return self.by_unknowns if same else None

    def balance_with(self, baseline: BaselineParameters) -> Balance:
        """The balance with what the harmonics add, to first order, where the unknowns are others."""
        assert self.balance is not None
        derivative = self.derivative(baseline)
        if derivative is None:
            return self.balance
        return with_more(self.balance, derivative @ (baseline.vector - self.baseline.vector))


def with_more(balance: Balance, change: Array) -> Balance:
    """A balance where something else is added to the stiffness of the first ports (s, p)."""
    stiffness = balance.added.stiffness.copy()
    stiffness[:, : change.shape[1]] += change
    return replace(balance, added=replace(balance.added, stiffness=stiffness))
