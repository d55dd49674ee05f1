"""Which cases a campaign runs, and in which order."""

from collections.abc import Sequence

import numpy as np

from recordings.errors import InputError
from twin.bench import check_effects
from twin.campaign.case import CasePlan
from twin.cause_registry import DRAWS
from twin.cause_registry.dice import Dice
from twin.rigs import Effect, Rig


def campaign_causes() -> tuple[str, ...]:
    """What can be hidden in a rig, causes from outside last.

    A dwell too short is a mistake of the procedure, and these procedures wait until the response has settled.
    """
    return tuple(name for name in DRAWS if name != "unsettled-dwell")


def fitting_causes(rig: Rig, causes: Sequence[str]) -> tuple[str, ...]:
    """Those of the causes that a rig can have: none of a joint where there is no joint, for one."""
    found = []
    for cause in causes:
        try:
            if cause != "none":
                effect = Effect(cause=cause, parameters=DRAWS[cause](Dice(np.random.default_rng(0), rig, 1.0)))
                check_effects(rig.model_copy(update={"effect": [effect]}), source=rig.name)
        except (ValueError, InputError):
            continue
        found.append(cause)
    return tuple(found)


def planned_cases(
    *, causes: Sequence[str], seeds: Sequence[int], strengths: Sequence[float] = (1.0,), pairs: int = 0, modes: int = 1
) -> tuple[CasePlan, ...]:
    """Every cause with every seed and strength, then pairs drawn from the causes.

    The seed changes slowest, so that a campaign that is interrupted has seen all causes alike.

    Parameters
    ----------
    causes
        Contract names; ``none`` is a clean rig, and is run once for each seed whatever the strengths.
    pairs
        How many pairs of different causes, each hidden at once at the first strength.
    modes
        Each case is swept about the first so many.

    Raises
    ------
    ValueError
        If there are not two causes for a pair.
    """
    plans = []
    for seed in seeds:
        for cause in dict.fromkeys(causes):
            if cause == "none":
                plans.append(CasePlan(seed, (), modes=modes))
            else:
                plans += [CasePlan(seed, (cause,), strength, modes) for strength in dict.fromkeys(strengths)]
    real = [cause for cause in dict.fromkeys(causes) if cause != "none"]
    if pairs and len(real) < 2:
        raise ValueError("needs two causes to draw from")
    for number in range(pairs):
        rng = np.random.default_rng([seeds[0], number])
        chosen = tuple(sorted(str(name) for name in rng.choice(real, size=2, replace=False)))
        plans.append(CasePlan(seeds[0] + number, chosen, strengths[0], modes))
    return tuple(plans)
