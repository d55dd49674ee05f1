"""Dry friction against the surroundings: a cable that drags, a probe that touches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from twin.diagnose.cause import Cause, Parameter, Values, position, single_point
from twin.identify.evidence import Evidence
from twin.identify.extension import Extension, NonlinearForce

__all__ = ["GroundFriction"]


class GroundFriction(Cause):
    """Coulomb friction, f = F sign(velocity): odd harmonics 4 F / (pi h), all in phase with the velocity."""

    name = "ground-friction"
    summary = "something drags on the structure with dry friction"

    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Friction force and place."""
        return (
            Parameter(name="force_N", scale=0.1, lower=0.0, upper=5.0, null=0.0, starts=(0.02,)),
            position(evidence, 8),
        )

    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """A local force; rounded off below a micrometre, where no friction is ideal."""
        F, sticking = values["force_N"], 1e-6

        def equivalent(a: Any, omega: Any) -> Any:
            return 1j * 4 * F / (np.pi * (a + sticking))

        def harmonics(a: Any, count: int, joint: Any = None) -> Any:
            h = np.arange(1, count + 1)
            return (a / (a + sticking))[:, None] * np.where(h % 2 == 1, 4j * F / (np.pi * h), 0)

        return Extension(nonlinear=(NonlinearForce(single_point(values["position_m"]), equivalent, harmonics),))
