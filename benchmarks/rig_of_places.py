"""A pinned beam by its modes with elements at any number of places: what harmonic balance and marching ask of a rig."""

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from twin.bench.build import Built
from twin.bench.linear import Inputs, LinearRig, Poles, ReadOff, linear_rig, to_poles
from twin.bench.marching import Elements
from twin.bench.reduction import ModalModel
from twin.joint import Law, jenkins

Array = NDArray[np.float64]

FIRST_Hz, DAMPING_RATIO = 30.0, 0.003
STATICS = 400
"""Modes in all; those that are not kept are statics."""
DRIVEN, SHOWN = 0.37, 0.61
"""Of the length."""
STUCK_SHARE = 0.5
"""Of the first mode's stiffness, that all sliders have together."""


@dataclass(frozen=True)
class RigOfPlaces:
    """One kilogram of beam, driven by a force, with an element of the law at each place.

    Attributes
    ----------
    places
        How many, at equal distances.
    modes
        Kept; the rest are statics.
    law
        Of each element.
    """

    places: int
    modes: int
    law: Law

    @property
    def locals(self) -> int:
        """One coordinate a place."""
        return self.places

    auxiliaries = 0

    @cached_property
    def linear(self) -> LinearRig:
        """From force and local forces to the displacements at the places and the acceleration that is shown."""
        k = np.arange(1, STATICS + 1)
        omega = np.asarray(2 * np.pi * FIRST_Hz * k**2, np.float64)
        residual = np.zeros((STATICS, STATICS))
        rest = k[self.modes :] - 1
        residual[rest, rest] = 1.0 / omega[rest] ** 2

        def row(x: float) -> Array:
            return np.sqrt(2.0) * np.sin(k * np.pi * x)

        rows = [row((a + 1.0) / (self.places + 1.0)) for a in range(self.places)]
        shown = ReadOff("acceleration", row(SHOWN))
        return linear_rig(
            ModalModel(omega[: self.modes], np.eye(STATICS)[:, : self.modes], residual),
            Inputs(drive_row=row(DRIVEN), drive_load=row(DRIVEN), loads=rows),
            [*(ReadOff("displacement", each) for each in rows), shown],
            damping=np.diag(2 * DAMPING_RATIO * omega[: self.modes]),
        )

    def poles(self, time_s: float, internal_rate_Hz: float) -> Poles:
        """The same at any time and rate, diagonal."""
        return to_poles(self.linear)

    def elements(self) -> Elements:
        """At rest."""
        n, each = self.places, np.arange(self.places)
        parameters = np.tile(np.asarray(self.law.parameters, float), (n, 1))
        state = np.zeros((n, max(self.law.states, 1)))
        return Elements(np.full(n, self.law.kind), each, np.full(n, -1), np.ones(n), parameters, state)

    @property
    def built(self) -> Built:
        """In place of a built rig."""
        return cast(Built, self)


def rig_of_sliders(places: int, *, modes: int = 11, slip_m: float = 2e-5) -> RigOfPlaces:
    """Jenkins elements that share the same stiffness, however many they are, and begin to slip at `slip_m`."""
    stiffness = STUCK_SHARE * (2 * np.pi * FIRST_Hz) ** 2 / places
    return RigOfPlaces(places, modes, jenkins(stiffness, stiffness * slip_m))
