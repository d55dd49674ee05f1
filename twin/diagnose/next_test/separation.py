"""How far a test would part two models: the log evidence that it is expected to bring for the true one.

The rival may still move: by how much is what its fit to the recordings left open.  To first order it then keeps of its
whitened difference r to the truth r' r - b' (J'J + P)^-1 b with b = J' r, J its sensitivities to the test, and P the
information that it has from the recordings.  Half of that is the gain of log evidence, and also half its variance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.fit_problem import FitProblem
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS as DIAGNOSE
from twin.diagnose.next_test.limits import LIMITS
from twin.diagnose.next_test.predicted_data import PredictedData
from twin.identify.cholesky import Cholesky


@dataclass(frozen=True, kw_only=True)
class Promise:
    """What a test is expected to bring."""

    separation: float
    needed: float
    """Gain of log evidence for whichever model is true, and what would be enough."""

    @property
    def share(self) -> float:
        """Of what is needed."""
        return self.separation / self.needed


def least_promise(
    best: FittedModel, rivals: Sequence[FittedModel], data: Sequence[PredictedData], *, margin: float
) -> Promise:
    """What a test brings at the least, whichever of the models is true.

    Parameters
    ----------
    data
        Of the test if the best were true, and if each rival were.
    margin
        Gain of log evidence by which a model counts as beaten.
    """
    promises = []
    for rival, if_rival in zip(rivals, data[1:], strict=True):
        # What the recordings say for the best must be made up for if the rival is true.
        gap = (best.log_evidence - rival.log_evidence) / DIAGNOSE.posterior_temperature
        # A model fits all that one within it makes: only its own data tell it from that.
        if not _contains(rival, best):
            promises.append(Promise(separation=separation(data[0], rival), needed=enough(margin - gap)))
        if not _contains(best, rival):
            promises.append(Promise(separation=separation(if_rival, best), needed=enough(margin + gap)))
    return min(promises, key=lambda promise: promise.share)


def _contains(one: FittedModel, other: FittedModel) -> bool:
    return {h.key for h in other.hypotheses} < {h.key for h in one.hypotheses}


def separation(predicted_data: PredictedData, rival: FittedModel) -> float:
    """Expected gain of log evidence over a rival if the test is as predicted."""
    trial = FitProblem(
        predicted_data.evidence, predicted_data.harmonics, rival.baseline, rival.hypotheses, errors=rival.errors
    )
    here = trial.weighed().here
    r, J = here.residual - predicted_data.left, here.jacobian
    if not (np.isfinite(r).all() and np.isfinite(J).all()):
        return 0.0
    follows = J.T @ r
    left = float(r @ r - follows @ Cholesky.of(J.T @ J + rival.solution.information).solve(follows))
    return 0.5 * max(left, 0.0) / DIAGNOSE.posterior_temperature


def enough(gap: float) -> float:
    """Separation that overcomes a gap of log evidence in nine of ten tests: D - sure sqrt(2 D) = gap.

    A rival that is behind already still asks for what noise alone would turn round, that at no gap at all.
    """
    sure = LIMITS.separation_sure
    root = (sure * np.sqrt(2.0) + np.sqrt(2.0 * sure**2 + 4.0 * max(gap, 0.0))) / 2.0
    return float(root**2)
