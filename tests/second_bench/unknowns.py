"""What no experimenter knows of a rig, and what is no fault: drawn anew for each case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.second_bench.believed import BELIEVED
from tests.second_bench.mechanics.beams import Beam
from tests.second_bench.mechanics.specimen import Layer, Specimen

MODULI = 0.15
"""Of the layer: a torque wrench's error."""
DIMENSIONS = 1e-4
"""Relative errors of what was measured with a calliper and a micrometer."""
SENSOR_MASSES = 2e-3
DAMPING = 0.2


def drawn_specimen(rng: np.random.Generator) -> Specimen:
    """A rig that is sound, but not the believed one to the last digit."""

    def about(value: float, share: float) -> float:
        return value * (1 + share * rng.normal())

    def within(value: float, share: float) -> float:
        return value * (1 + share * rng.uniform(-1, 1))

    def beam(believed: Beam) -> Beam:
        return replace(
            believed,
            width=about(believed.width, DIMENSIONS),
            thickness=about(believed.thickness, DIMENSIONS),
            density=about(believed.density, DIMENSIONS),
            modulus=about(believed.modulus, DIMENSIONS),
        )

    layer = replace(
        BELIEVED.layer,
        normal_modulus=within(BELIEVED.layer.normal_modulus, MODULI),
        shear_modulus=within(BELIEVED.layer.shear_modulus, MODULI),
        **_law(rng),
    )
    return replace(
        BELIEVED,
        lower=beam(BELIEVED.lower),
        upper=beam(BELIEVED.upper),
        layer=layer,
        masses=tuple((x, about(mass, SENSOR_MASSES)) for x, mass in BELIEVED.masses),
        modal_ratio=tuple(within(ratio, DAMPING) for ratio in BELIEVED.modal_ratio),
    )


def _law(rng: np.random.Generator) -> dict[str, float]:
    """The joint's law, about that which gives the steel paper's peaks at 1.5, 3 and 6 N; fields of a `Layer`."""
    law: Layer = BELIEVED.layer
    return {
        "softening": float(rng.uniform(0.55, 0.8)),
        "opening_m": law.opening_m * float(np.exp(rng.uniform(-0.3, 0.3))),
        "early": float(rng.uniform(0.0, 0.4)),
        "friction": law.friction * float(np.exp(rng.uniform(-0.3, 0.3))),
        "slip_m": law.slip_m * float(np.exp(rng.uniform(-0.4, 0.4))),
        "travel_m": law.travel_m * float(np.exp(rng.uniform(-0.3, 0.3))),
    }
