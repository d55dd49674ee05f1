"""How large each cause usually is, for a rig of the steel rig's kind: a plausible mistake that data show clearly."""

from collections.abc import Callable

import numpy as np

from twin.cause_registry.dice import Dice, Parameters


def _clamp_compliance(dice: Dice) -> Parameters:
    """A share of the beam's own compliance, L / EI."""
    layout = dice.rig.layout()
    held = [s.part for s in layout.supports if s.holds_rotation and s.part in {beam.name for beam in layout.beams}]
    if not held:
        raise ValueError("clamp-compliance needs a support that holds a beam's rotation")
    beam = layout.beam(held[0])
    return {"rotational_rad_per_Nm": dice.size(5e-3, 1e-2) * layout.length / (beam.youngs_modulus * beam.second_moment)}


def _cubic_stiffness(dice: Dice) -> Parameters:
    """A spring that does as much wherever it is: its work in mode 1 goes with some sixth power of the place."""
    place = dice.along(0.7, 1.0)
    layout = dice.rig.layout()
    if "node" in place:
        return {**place, "stiffness_N_per_m3": dice.size(3e6, 8e6)}
    length = layout.beam(str(place["part"])).length if "part" in place else layout.length
    return {**place, "stiffness_N_per_m3": dice.size(3e6, 8e6) * (length / float(place["position_m"])) ** 6}


def _joint_friction(dice: Dice) -> Parameters:
    """A friction spring that begins to slip within the amplitudes of the steel rig's sweeps."""
    stiffness = float(dice.size(1.5e8, 3e8))
    chosen = dice.joint()
    joint = next(joint for joint in dice.rig.joints if chosen.get("joint", joint.name) == joint.name)
    return {
        **chosen,
        "layer_element": str(dice.rng.choice([1, joint.layer_elements])),
        "stiffness_N_per_m": stiffness,
        "slip_force_N": stiffness * dice.plain(2e-7, 4e-7),
    }


def _stiffness_loss(dice: Dice) -> Parameters:
    """A weak section, which only a beam has."""
    if not dice.rig.layout().beams:
        raise ValueError("stiffness-loss needs a beam")
    return {**dice.along(0.05, 0.9), "factor": dice.lost(0.2, 0.5)}


def _sensor_position(dice: Dice) -> Parameters:
    """A shift that stays on the structure."""
    channel, offset = dice.response(), dice.signed(0.006, 0.015)
    _, forth = dice.rig.layout().reach(dice.rig.place_of(channel))
    return {"channel": channel, "offset_m": -abs(offset) if abs(offset) > forth else offset}


def _cross_talk(dice: Dice) -> Parameters:
    """Of acceleration, or of the force, whose volts are larger."""
    channel = dice.response()
    source = str(dice.rng.choice([s.channel for s in dice.rig.sensor if s.channel != channel]))
    scale = 20.0 if source == dice.rig.force_sensor.channel else 1.0
    return {"channel": channel, "source": source, "factor": scale * dice.signed(0.01, 0.04)}


LISTED: dict[str, Callable[[Dice], Parameters]] = {
    "added-mass": lambda dice: {**dice.along(0.6, 1.0), "mass_kg": dice.size(0.006, 0.015)},
    "beam-modulus": lambda dice: {"beam": dice.beam(), "factor": 1.0 + dice.signed(0.02, 0.05)},
    "clamp-compliance": _clamp_compliance,
    "transverse-shear": lambda dice: {"beam": dice.beam(), "modulus_ratio": dice.size(20.0, 80.0)},
    "stiffness-loss": _stiffness_loss,
    "attached-resonator": lambda dice: {
        **dice.along(0.4, 1.0),
        "mass_kg": dice.size(0.003, 0.01),
        "frequency_Hz": dice.plain(60.0, 400.0),
        "damping_ratio": dice.plain(0.01, 0.03),
    },
    "cubic-stiffness": _cubic_stiffness,
    "ground-friction": lambda dice: {**dice.along(0.7, 1.0), "force_N": dice.size(0.01, 0.03)},
    "ground-stop": lambda dice: {
        **dice.along(0.7, 1.0),
        "gap_m": dice.plain(3e-4, 1.2e-3),
        "stiffness_N_per_m": dice.size(50.0, 200.0),
    },
    "viscous-damper": lambda dice: {**dice.along(0.7, 1.0), "damping_Ns_per_m": dice.size(0.3, 1.0)},
    "air-drag": lambda dice: {"coefficient_Ns2_per_m3": dice.size(1.0, 3.0)},
    "joint-stiffness": lambda dice: {
        **dice.joint(),
        "normal_factor": dice.lost(0.2, 0.4),
        "shear_factor": dice.lost(0.2, 0.4),
    },
    "joint-slap": lambda dice: {
        **dice.joint(),
        "gap_m": dice.plain(1.5e-7, 4e-7),
        "stiffness_factor": dice.lost(0.08, 0.16),
    },
    "joint-friction": _joint_friction,
    "joint-uneven": lambda dice: {**dice.joint(), "gradient": float(np.clip(dice.signed(0.8, 1.5), -1.8, 1.8))},
    "preload-loss": lambda dice: {**dice.joint(), "rate_per_s": dice.size(1e-4, 3e-4)},
    "drive-mass": lambda dice: {"mass_kg": dice.size(0.03, 0.1)},
    "stinger-stiffness": lambda dice: {"stiffness_N_per_m": dice.size(1e4, 4e4)},
    "drive-position": lambda dice: {"channel": dice.rig.force_sensor.channel, "offset_m": dice.signed(0.004, 0.01)},
    "sensor-position": _sensor_position,
    "base-motion": lambda dice: {"receptance_m_per_N": dice.size(3e-8, 1.5e-7)},
    "temperature-drift": lambda dice: {"rate_per_s": dice.size(3e-6, 1e-5)},
    "channel-gain": lambda dice: {"channel": dice.response(), "factor": 1.0 + dice.signed(0.03, 0.10)},
    "channel-delay": lambda dice: {"channel": dice.response(), "delay_s": dice.size(2e-5, 2e-4)},
    "channel-polarity": lambda dice: {"channel": dice.response()},
    "clipping": lambda dice: {"channel": dice.response(), "limit": dice.plain(25.0, 40.0) / dice.strength},
    "ac-coupling": lambda dice: {"channel": dice.response(), "corner_Hz": dice.size(0.5, 2.0)},
    "mounting-resonance": lambda dice: {
        "channel": dice.response(),
        "frequency_Hz": dice.plain(1500.0, 3000.0) / dice.strength,
        "damping_ratio": dice.plain(0.02, 0.05),
    },
    "cross-talk": _cross_talk,
    "mains-hum": lambda dice: {"channel": dice.response(), "frequency_Hz": 50.0, "amplitude": dice.size(0.2, 1.0)},
    "sample-clock": lambda dice: {"error_ppm": dice.signed(300.0, 2000.0)},
    "unsettled-dwell": lambda dice: {
        "sweep": f"{dice.rng.choice(['1.5', '3', '6'])}N-{dice.rng.choice(['up', 'down'])}"
    },
    "lost-samples": lambda dice: {"channel": dice.response()},
    "quantisation": lambda dice: {"channel": dice.response(), "step": dice.size(0.05, 0.3)},
}
"""The causes of the recording contract, in the order of lists and reports, with what draws parameters of normal size.

The folders of :mod:`twin.causes` are named alike.
"""
