"""Where an answer's numbers do not bear it out: its first sentence says so, and a command ends with status 1."""

from twin.diagnose.answer.misfit import HeldOut, Misfit, Verdict
from twin.diagnose.limits import LIMITS


def shortfall(verdict: Verdict, misfit: Misfit, gain: HeldOut | None) -> str:
    """What a model leaves unexplained, with figures, as the end of a sentence; empty where that is nothing.

    A gain is none where the held-out error is still several times its noise, or has grown.
    """
    before, after = (0.0, 0.0) if gain is None else gain.in_deviations
    if gain is not None and after - before > LIMITS.least_growth:
        return f"the held-out error grew from {100 * gain.before:.2g} % to {100 * gain.after:.2g} %"
    if gain is not None and after > LIMITS.several_times:
        return (
            f"the held-out error of {100 * gain.after:.2g} % is still several times its noise, "
            f"{100 * gain.noise_floor:.2g} %"
        )
    if verdict == "none" and misfit.after > misfit.threshold:
        return f"chi² per degree of freedom is {misfit.after:.3g}, where up to {misfit.threshold:.3g} agrees"
    return ""


def told_with(sentence: str, left: str) -> str:
    """An answer behind what it leaves unexplained, if anything."""
    return f"Not explained: {left}.  {sentence}" if left else sentence


def explains(verdict: Verdict, left: str) -> bool:
    """Whether an answer is one: one verdict that is settled, and nothing left unexplained."""
    return verdict in ("explained", "none") and not left
