"""What a bench is built from, open to effects: each hidden effect alters the plan in one or two places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from twin.bench.instruments import InstrumentChannel
from twin.bench.layer import JointLaw
from twin.joint import Law
from twin.rigs import Rig
from twin.structure import Structure

__all__ = ["Element", "JointSlider", "Matrices", "Plan"]

Matrix = NDArray[np.float64]


@dataclass
class Matrices:
    """Matrices of the free finite-element degrees of freedom, to which effects add springs, dampers and resonators.

    Attributes
    ----------
    M, K_beam, K_E, K_G, C : ndarray, (n, n)
        Mass; stiffness but for the layer; layer per unit of E' and of G'; viscous dampers.
    structure : Structure
        Whose rows give positions; resonators' coordinates come after its own.
    """

    M: Matrix
    K_beam: Matrix
    K_E: Matrix
    K_G: Matrix
    C: Matrix
    structure: Structure

    def pad(self, row: Matrix) -> Matrix:
        """A row over the structure's coordinates, with zeros for those that were appended."""
        return np.concatenate([row, np.zeros(len(self.M) - len(row))])

    def deflection(self, position_m: float) -> Matrix:
        """Row of v(position)."""
        return self.pad(self.structure.deflection(position_m))

    def append_resonator(self, position_m: float, mass_kg: float, frequency_Hz: float, damping_ratio: float) -> None:
        """Hang a mass on a spring and a dashpot at a position."""
        w = 2 * np.pi * frequency_Hz
        row = np.concatenate([self.deflection(position_m), [-1.0]])
        for name in ("M", "K_beam", "K_E", "K_G", "C"):
            setattr(self, name, np.pad(getattr(self, name), (0, 1)))
        self.M[-1, -1] = mass_kg
        self.K_beam += mass_kg * w**2 * np.outer(row, row)
        self.C += 2 * damping_ratio * w * mass_kg * np.outer(row, row)


@dataclass(frozen=True, eq=False)
class Element:
    """A nonlinear element on a row of the matrices' coordinates.

    `velocity` makes the coordinate the row's time derivative (the law then may read the displacement).  `follows` tells
    which drift scales it: the layer's modulus E', all moduli, or none.
    """

    row: Matrix
    law: Law
    scale: float = 1.0
    velocity: bool = False
    follows: str = ""


@dataclass(frozen=True)
class JointSlider:
    """A friction element on the slip of one of the layer's points, counted from the clamp's end."""

    point: int
    stiffness_N_per_m: float
    slip_force_N: float


@dataclass
class Plan:
    """A rig as the truth has it.  Effects change `rig` first, then matrices, elements and instruments.

    Attributes
    ----------
    rig
        As the experimenter believes, then as it is.
    E, G
        Moduli of the layer, N/m2.
    law
        The joint's law; None takes the rig file's or the default.
    law_changes
        Called in order with the law and E'.
    clamp_compliance
        Rotation of the root per moment, rad/(N m).
    base_receptance
        Motion of the clamp per drive force, m/N.
    layer_gradient
        How much E' and G' fall along the overlap, evenly about its middle, as a share of their value there.
    layer_rate_per_s, moduli_rate_per_s
        Relative loss per second of E', and of all moduli.
    clock_error
        Relative error of the converter's clock.
    joint_sliders
        Friction elements in the layer.
    matrix_changes, element_makers
        Called in order with the matrices.
    instruments
        By channel.
    """

    rig: Rig
    E: float
    G: float
    law: JointLaw | None
    instruments: dict[str, InstrumentChannel]
    clamp_compliance: float = 0.0
    base_receptance: float = 0.0
    layer_gradient: float = 0.0
    layer_rate_per_s: float = 0.0
    moduli_rate_per_s: float = 0.0
    clock_error: float = 0.0
    law_changes: list[Callable[[JointLaw, float], JointLaw]] = field(default_factory=list)
    joint_sliders: list[JointSlider] = field(default_factory=list)
    matrix_changes: list[Callable[[Matrices], None]] = field(default_factory=list)
    element_makers: list[Callable[[Matrices], list[Element]]] = field(default_factory=list)

    def instrument(self, channel: str) -> InstrumentChannel:
        """The channel's signal path.

        Raises
        ------
        ValueError
            If the rig has no such channel.
        """
        if channel not in self.instruments:
            raise ValueError(f"no channel {channel!r}; the rig has {', '.join(self.instruments)}")
        return self.instruments[channel]

    def move_sensor(self, channel: str, offset_m: float) -> None:
        """Shift a sensor (or, for the force cell, the drive) along the structure."""
        self.instrument(channel)
        end = self.rig.length
        sensors = [
            s.model_copy(update={"position": min(max(s.position + offset_m, 0.0), end)}) if s.channel == channel else s
            for s in self.rig.sensor
        ]
        self.rig = self.rig.model_copy(update={"sensor": sensors})
