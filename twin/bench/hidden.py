"""Drawing a hidden case: a cause of plausible size, and what no experimenter knows of the rig anyway."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bench.bench import Bench, open_bench
from twin.bench.layer import default_law
from twin.rigs import Effect, Rig

__all__ = ["DRAWN_CAUSES", "FIRST_CAUSES", "HiddenCase", "draw_case"]

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
    """The truth behind a recording.

    Attributes
    ----------
    effects
        The hidden causes; none where nothing is wrong.
    rig
        The rig as it is: moduli of the layer and damping differ from what was believed, the effect apart.
    softening, loss
        Factors on the joint's default law.
    """

    effects: tuple[Effect, ...]
    rig: Rig
    softening: float = 1.0
    loss: float = 1.0

    def open_bench(self, *, preload: str | None = None, **options: Any) -> Bench:
        """The bench with the effect in it; `options` as for :func:`twin.bench.open_bench`."""
        laws = {
            joint.name: default_law(moduli.normal_modulus).scaled(softening=self.softening, loss=self.loss)
            for joint, moduli in zip(self.rig.joints, self.rig.moduli(preload), strict=True)
            if joint.law is None
        }
        options.setdefault("joint_law", laws)
        return open_bench(self.rig, preload=preload, effects=self.effects, **options)


def draw_case(
    rng: np.random.Generator,
    *,
    rig: Rig,
    causes: Sequence[str] | None = None,
    number: int = 1,
    strength: float = 1.0,
) -> HiddenCase:
    """Draw causes, their parameters, and the true values of what is always unknown.

    E' and G' lie within 10 % of what is believed, each damping ratio within 20 %, softening and loss of the joint's law
    within 20 %.

    Parameters
    ----------
    rng
        Chance.
    rig
        As the experimenter believes.
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
        if name not in SIZES:
            raise ValueError(f"no cause {name!r} can be drawn; there are none, {', '.join(SIZES)}")
        effects.append(Effect(cause=name, parameters=SIZES[name](_Dice(rng, rig, strength))))
    near = [
        joint.model_copy(
            update={
                "preload": {
                    key: moduli.model_copy(
                        update={
                            "normal_modulus": moduli.normal_modulus * rng.uniform(0.9, 1.1),
                            "shear_modulus": moduli.shear_modulus * rng.uniform(0.9, 1.1),
                        }
                    )
                    for key, moduli in joint.preload.items()
                }
            }
        )
        for joint in rig.joints
    ]
    ratios = [ratio * rng.uniform(0.8, 1.2) for ratio in rig.damping.modal_ratio]
    damping = rig.damping.model_copy(update={"modal_ratio": ratios})
    truth = rig.with_joints(near).model_copy(update={"damping": damping})
    return HiddenCase(
        effects=tuple(effects),
        rig=truth,
        softening=float(rng.uniform(0.8, 1.2)),
        loss=float(rng.uniform(0.8, 1.2)),
    )


@dataclass(frozen=True)
class _Dice:
    """Ways of drawing a parameter."""

    rng: np.random.Generator
    rig: Rig
    strength: float

    def size(self, low: float, high: float) -> float:
        """Log-uniform, times the strength."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high)))) * self.strength

    def plain(self, low: float, high: float) -> float:
        """Uniform, whatever the strength."""
        return float(self.rng.uniform(low, high))

    def signed(self, low: float, high: float) -> float:
        """A size of either sign."""
        return self.size(low, high) * float(self.rng.choice([-1.0, 1.0]))

    def lost(self, low: float, high: float) -> float:
        """A factor below one, from the share that is lost."""
        return 1.0 - min(self.size(low, high), 0.95)

    def beam(self) -> str:
        """One of the rig's."""
        return str(self.rng.choice([beam.name for beam in self.rig.layout().beams]))

    def response(self) -> str:
        """A response channel."""
        return str(self.rng.choice([s.channel for s in self.rig.response_sensors]))

    def joint(self) -> dict[str, float | str]:
        """One of several joints; nothing to say of a single one."""
        names = [joint.name for joint in self.rig.joints]
        return {"joint": str(self.rng.choice(names))} if len(names) > 1 else {}

    def along(self, low: float, high: float) -> dict[str, float | str]:
        """A place, as shares of the length: of the whole structure where it is one line of beams, else of a beam."""
        layout = self.rig.layout()
        if layout.passable:
            return {"position_m": self.plain(low, high) * layout.length}
        beam = layout.beam(self.beam())
        return {"part": beam.name, "position_m": self.plain(low, high) * beam.length}


def _cross_talk(d: _Dice) -> dict[str, float | str]:
    sources = [s.channel for s in d.rig.sensors]
    channel = d.response()
    source = str(d.rng.choice([c for c in sources if c != channel]))
    scale = 20.0 if source == d.rig.force_sensor.channel else 1.0
    return {"channel": channel, "source": source, "factor": scale * d.signed(0.01, 0.04)}


def _clamp(d: _Dice) -> dict[str, float | str]:
    layout = d.rig.layout()
    held = [s.part for s in layout.supports if "rz" in s.fix and s.part in {beam.name for beam in layout.beams}]
    if not held:
        raise ValueError("clamp-compliance needs a support that holds a beam's rotation")
    beam = layout.beam(held[0])
    return {"rotational_rad_per_Nm": d.size(5e-3, 1e-2) * layout.length / (beam.youngs_modulus * beam.second_moment)}


def _cubic(d: _Dice) -> dict[str, float | str]:
    """A spring that does as much wherever it is: its work in mode 1 goes with some sixth power of the place."""
    place = d.along(0.7, 1.0)
    layout = d.rig.layout()
    length = layout.beam(str(place["part"])).length if "part" in place else layout.length
    return {
        **place,
        "stiffness_N_per_m3": d.size(3e6, 8e6) * (length / float(place["position_m"])) ** 6,
    }


def _friction(d: _Dice) -> dict[str, float | str]:
    """A friction spring that begins to slip within the amplitudes of the steel rig's sweeps."""
    stiffness = float(d.size(1.5e8, 3e8))
    chosen = d.joint()
    joint = next(joint for joint in d.rig.joints if chosen.get("joint", joint.name) == joint.name)
    element = d.rng.choice([1, joint.layer_elements])
    return {
        **chosen,
        "layer_element": str(element),
        "stiffness_N_per_m": stiffness,
        "slip_force_N": stiffness * d.plain(2e-7, 4e-7),
    }


def _offset(d: _Dice) -> dict[str, float | str]:
    """A sensor shift that stays on the structure."""
    channel, offset = d.response(), d.signed(0.006, 0.015)
    _, forth = d.rig.layout().reach(d.rig.place_of(channel))
    return {"channel": channel, "offset_m": -abs(offset) if abs(offset) > forth else offset}


SIZES: dict[str, Callable[[_Dice], dict[str, float | str]]] = {
    "added-mass": lambda d: {**d.along(0.6, 1.0), "mass_kg": d.size(0.006, 0.015)},
    "beam-modulus": lambda d: {"beam": d.beam(), "factor": 1.0 + d.signed(0.02, 0.05)},
    "clamp-compliance": _clamp,
    "transverse-shear": lambda d: {"beam": d.beam(), "modulus_ratio": d.size(20.0, 80.0)},
    "stiffness-loss": lambda d: {**d.along(0.05, 0.9), "factor": d.lost(0.2, 0.5)},
    "attached-resonator": lambda d: {
        **d.along(0.4, 1.0),
        "mass_kg": d.size(0.003, 0.01),
        "frequency_Hz": d.plain(60.0, 400.0),
        "damping_ratio": d.plain(0.01, 0.03),
    },
    "cubic-stiffness": _cubic,
    "ground-friction": lambda d: {**d.along(0.7, 1.0), "force_N": d.size(0.01, 0.03)},
    "ground-stop": lambda d: {
        **d.along(0.7, 1.0),
        "gap_m": d.plain(3e-4, 1.2e-3),
        "stiffness_N_per_m": d.size(50.0, 200.0),
    },
    "viscous-damper": lambda d: {**d.along(0.7, 1.0), "damping_Ns_per_m": d.size(0.3, 1.0)},
    "air-drag": lambda d: {"coefficient_Ns2_per_m3": d.size(1.0, 3.0)},
    "joint-stiffness": lambda d: {
        **d.joint(),
        "normal_factor": d.lost(0.2, 0.4),
        "shear_factor": d.lost(0.2, 0.4),
    },
    "joint-slap": lambda d: {**d.joint(), "gap_m": d.plain(1.5e-7, 4e-7), "stiffness_factor": d.lost(0.08, 0.16)},
    "joint-friction": _friction,
    "joint-uneven": lambda d: {**d.joint(), "gradient": float(np.clip(d.signed(0.8, 1.5), -1.8, 1.8))},
    "preload-loss": lambda d: {**d.joint(), "rate_per_s": d.size(1e-4, 3e-4)},
    "drive-mass": lambda d: {"mass_kg": d.size(0.03, 0.1)},
    "stinger-stiffness": lambda d: {"stiffness_N_per_m": d.size(1e4, 4e4)},
    "drive-position": lambda d: {"channel": d.rig.force_sensor.channel, "offset_m": d.signed(0.004, 0.01)},
    "sensor-position": _offset,
    "base-motion": lambda d: {"receptance_m_per_N": d.size(3e-8, 1.5e-7)},
    "temperature-drift": lambda d: {"rate_per_s": d.size(3e-6, 1e-5)},
    "channel-gain": lambda d: {"channel": d.response(), "factor": 1.0 + d.signed(0.03, 0.10)},
    "channel-delay": lambda d: {"channel": d.response(), "delay_s": d.size(2e-5, 2e-4)},
    "channel-polarity": lambda d: {"channel": d.response()},
    "clipping": lambda d: {"channel": d.response(), "limit": d.plain(25.0, 40.0) / d.strength},
    "ac-coupling": lambda d: {"channel": d.response(), "corner_Hz": d.size(0.5, 2.0)},
    "mounting-resonance": lambda d: {
        "channel": d.response(),
        "frequency_Hz": d.plain(1500.0, 3000.0) / d.strength,
        "damping_ratio": d.plain(0.02, 0.05),
    },
    "cross-talk": _cross_talk,
    "mains-hum": lambda d: {"channel": d.response(), "frequency_Hz": 50.0, "amplitude": d.size(0.2, 1.0)},
    "sample-clock": lambda d: {"error_ppm": d.signed(300.0, 2000.0)},
    "unsettled-dwell": lambda d: {"sweep": f"{d.rng.choice(['1.5', '3', '6'])}N-{d.rng.choice(['up', 'down'])}"},
    "lost-samples": lambda d: {"channel": d.response()},
    "quantisation": lambda d: {"channel": d.response(), "step": d.size(0.05, 0.3)},
}
"""Parameters of normal size, for a rig of the steel rig's kind."""

DRAWN_CAUSES = tuple(SIZES)
"""Every cause that can be drawn."""
