"""What is wrong with the demonstration's rig, drawn from a seed."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bench import FIRST_CAUSES, draw_case
from twin.rigs import Rig


@dataclass(frozen=True, kw_only=True)
class DemoCase:
    """The truth, and what the result calls it."""

    rig: Rig
    """The rig as it is, with the hidden effect in it: what the virtual instruments serve."""
    hidden: dict[str, Any]
    """``cause`` and ``parameters``, in SI units."""


def draw_demo_case(rig: Rig, *, seed: int, cause: str | None = None) -> DemoCase:
    """Draw a case: one cause at its normal size, moduli and damping off by what no experimenter knows.

    Parameters
    ----------
    cause
        Hide this one, ``none`` for nothing; drawn from :data:`twin.bench.FIRST_CAUSES` if not given.
    """
    drawn = draw_case(np.random.default_rng(seed), rig=rig, causes=[cause] if cause else FIRST_CAUSES)
    if not drawn.effects:
        return DemoCase(rig=drawn.rig, hidden={"cause": "none", "parameters": {}})
    (effect,) = drawn.effects
    truth = drawn.rig.model_copy(update={"effect": [effect]})
    return DemoCase(rig=truth, hidden={"cause": effect.cause, "parameters": dict(effect.parameters)})
