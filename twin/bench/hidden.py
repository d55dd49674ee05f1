"""Drawing a hidden case: a cause of plausible size, and what no experimenter knows of the rig anyway."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.bench.bench import Bench, open_bench
from twin.bench.layer import steel_law
from twin.cause_registry import DRAWS, Dice
from twin.rigs import Effect, LawOfRig, Preload, Rig, moduli_at

FIRST_CAUSES = (
    "added-mass",
    "clamp-compliance",
    "joint-slap",
    "joint-friction",
    "cubic-stiffness",
    "channel-gain",
    "channel-delay",
)
"""What is drawn from where nothing is asked for."""


@dataclass(frozen=True, kw_only=True)
class HiddenCase:
    """The truth behind a recording."""

    effects: tuple[Effect, ...]
    """The hidden causes; none where nothing is wrong."""
    rig: Rig
    """The rig as it is: moduli of the layer and damping differ from what was assumed, the effect apart."""
    softening: float = 1.0
    loss: float = 1.0
    """Factors on the joint's law where it is the steel rig's."""

    def open_bench(self, *, seed: int = 0) -> Bench:
        """The bench with the effect in it, at the rig's first preload."""
        laws = {
            joint.name: steel_law(moduli.normal_modulus, softening=self.softening, loss=self.loss)
            for joint, moduli in zip(self.rig.joints, moduli_at(self.rig), strict=True)
            if isinstance(joint.law, LawOfRig)
        }
        return open_bench(self.rig, seed=seed, effects=self.effects, joint_law=laws)


def draw_case(
    rng: np.random.Generator, *, rig: Rig, causes: Sequence[str] | None = None, number: int = 1, strength: float = 1.0
) -> HiddenCase:
    """Draw causes, their parameters, and the true values of what is always unknown.

    E' and G' lie within 10 % of what is assumed, each damping ratio within 20 %, softening and loss of the joint's law
    within 20 %.

    Parameters
    ----------
    causes
        Contract names to draw from, ``none`` among them if wanted; :data:`FIRST_CAUSES` if not given.
    number
        How many different ones of them act at once.
    strength
        Factor on the normal size of a cause, which is a plausible mistake that the data show clearly.

    Raises
    ------
    ValueError
        If a name is unknown, or there are not enough of them.
    """
    left = list(dict.fromkeys(causes or FIRST_CAUSES))
    if number > len(left):
        raise ValueError(f"{number} different causes cannot be drawn from {', '.join(left)}")
    effects = []
    for _ in range(number):
        name = str(rng.choice(left))
        left.remove(name)
        if name == "none":
            continue
        if name not in DRAWS:
            raise ValueError(f"no cause {name!r} can be drawn; there are none, {', '.join(DRAWS)}")
        effects.append(Effect(cause=name, parameters=DRAWS[name](Dice(rng, rig, strength))))
    near = [
        joint.model_copy(update={"preload": {key: _near(moduli, rng) for key, moduli in joint.preload.items()}})
        for joint in rig.joints
    ]
    ratios = [ratio * rng.uniform(0.8, 1.2) for ratio in rig.damping.modal_ratio]
    damping = rig.damping.model_copy(update={"modal_ratio": ratios})
    truth = rig.with_joints(near).model_copy(update={"damping": damping})
    return HiddenCase(
        effects=tuple(effects), rig=truth, softening=float(rng.uniform(0.8, 1.2)), loss=float(rng.uniform(0.8, 1.2))
    )


def _near(moduli: Preload, rng: np.random.Generator) -> Preload:
    """Moduli within 10 % of what is assumed."""
    E, G = (value * rng.uniform(0.9, 1.1) for value in (moduli.normal_modulus, moduli.shear_modulus))
    return Preload(normal_modulus=E, shear_modulus=G)
