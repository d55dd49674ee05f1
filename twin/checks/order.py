"""Channels that are swapped or turned: which order of them has the model's shapes."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from recordings.run import Run
from twin.arrays import Array
from twin.checks.agreement import Agreement, RunBesideModel, clear_lines, misfit
from twin.checks.finding import Action, Finding
from twin.checks.responses import NoiseResponse, noise_responses
from twin.checks.thresholds import CLEARER, SHAPE

MOST_CHANNELS = 6
"""Whose orders are all tried."""
FIRST_MISFIT = 0.1
"""Below that no better order is looked for: sound recordings have 0.01 to 0.4."""


def look_at_order(seen: RunBesideModel) -> list[Finding]:
    """At most one finding: another order of the channels that fits several times better than the file's."""
    force, channels = seen.force, seen.channels
    if len(channels) >= MOST_CHANNELS:
        return []
    best = _by_noise(seen) if seen.noise else _by_sines(seen) if seen.sines and len(channels) > 1 else None
    if best is None:
        return []
    order, misfits = best
    moved = [f"{was} is {name}" for was, name in zip((force, *channels), order, strict=True) if was != name]
    expected_text = f"the rig's shapes of response (misfit {misfits[0]:.2f}, in that order {misfits[1]:.2f})"
    found = f"another order fits: {', '.join(moved)}"
    return [Finding(seen.run.path, order[0] if order[0] != force else "", "swapped", expected_text, found, "stopped")]


def _by_noise(seen: RunBesideModel) -> tuple[tuple[str, ...], tuple[float, float]] | None:
    """By the interquartile range of each channel's log response over another one's expected one."""
    noise, expected, force, channels = seen.noise[0], seen.expected, seen.force, seen.channels
    every = (force, *channels)

    def table(of: NoiseResponse) -> Array:
        clear = clear_lines(of, expected)
        if clear.sum() < 16:
            return np.full((len(channels), len(channels)), np.inf)
        P = expected.H(of.frequency_Hz[clear])
        return np.array([[misfit(h, p) for p in P.T] for h in of.H[clear].T])

    own = float(np.mean(np.diag(table(noise))))
    if own < FIRST_MISFIT:
        return None
    tried: list[tuple[float, tuple[str, ...]]] = []
    # What force is swapped with drives; only where the file's own force makes no response of the rig's at all.
    for drives in every if own > SHAPE else (force,):
        rest = tuple(name for name in every if name != drives)
        of = noise if drives == force else noise_responses(seen.run, force=drives, channels=rest)[0]
        costs = table(of)
        for order in permutations(range(len(rest))):
            cost = float(np.mean(costs[range(len(rest)), order]))
            # `order` says which of the rig's channels each recorded one is.
            names = {drives: force} | {name: channels[j] for name, j in zip(rest, order, strict=True)}
            tried.append((cost, tuple(names[name] for name in every)))
    cost, order_found = min(tried)
    return (order_found, (own, cost)) if order_found != every and CLEARER * cost < own else None


def _by_sines(seen: RunBesideModel) -> tuple[tuple[str, ...], tuple[float, float]] | None:
    """By the ratios of the channels' responses, which near a resonance are its shape's."""
    expected, channels, moving = seen.expected, seen.channels, [one for one in seen.sines if one.H.all()]
    if not moving:
        return None
    nominal = np.log(np.abs(np.concatenate([expected.H(one.frequency_Hz) for one in moving])))
    measured = np.log(np.abs(np.concatenate([one.H for one in moving])))

    def cost(order: tuple[int, ...]) -> float:
        return float(np.ptp(np.median(measured - nominal[:, list(order)], axis=0)))

    kinds = [output.quantity for output in expected.model.outputs]
    same = tuple(range(len(channels)))
    orders = [order for order in permutations(same) if all(kinds[i] == kinds[j] for i, j in enumerate(order))]
    best = min(orders, key=cost)
    if best == same or cost(same) < SHAPE or CLEARER * cost(best) > cost(same):
        return None
    return (seen.force, *(channels[j] for j in best)), (cost(same), cost(best))


def look_at_directions(runs: Sequence[tuple[Run, Agreement]], *, force: str, channels: Sequence[str]) -> list[Finding]:
    """Channels that move against the model in all runs, or in some of them only.

    A single turned response is told: to name it is a diagnosis' business.  Where all of several are turned it is the
    force that is, or their cabling, and where runs differ no one model can hold.
    """
    turned = {tuple(agreement.turned) for _, agreement in runs}
    findings = []
    for run, agreement in runs[: 1 if len(turned) == 1 else None]:
        names = [channel for channel, one in zip(channels, agreement.turned, strict=True) if one]
        if not names:
            continue
        whole = len(names) == len(channels) > 1
        found = f"{', '.join(names)} turned" + (f", or {force} alone" if whole else "")
        found += ", and not in every run" if len(turned) > 1 else ""
        action: Action = "stopped" if whole or len(turned) > 1 else "told"
        expected = "the direction that the rig's model has"
        findings.append(Finding(run.path, force if whole else names[0], "direction", expected, found, action))
    return findings
