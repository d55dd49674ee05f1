"""What a bench is built from, open to effects: each hidden effect alters the plan in one or two places."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array

from recordings.directions import unit_vector
from twin.arrays import Array
from twin.bench.instruments import InstrumentChannel
from twin.bench.layer import JointLaw
from twin.joint import Law
from twin.rigs import BeamPart, Layout, Place, Rig
from twin.structure import Structure
from twin.structure.sparse import with_coordinate, with_square


@dataclass
class Matrices:
    """Matrices of the structure's coordinates, to which effects add springs, dampers and resonators."""

    M: Array | csr_array
    K0: Array | csr_array
    """Mass; stiffness but for the joints' layers, (n, n)."""
    K_E: list[Array | csr_array]
    K_G: list[Array | csr_array]
    """Each joint's layer per unit of E' and of G', (n, n)."""
    C: Array | csr_array
    """Of viscous dampers, (n, n)."""
    structure: Structure
    """Whose rows give places; resonators' coordinates come after its own."""

    def pad(self, row: Array) -> Array:
        """A row over the structure's coordinates, with zeros for those that were appended."""
        return np.concatenate([row, np.zeros(self.M.shape[0] - len(row))])

    def row(self, place: Place) -> Array:
        """Row of the displacement at a place in its direction."""
        return self.pad(self.structure.row(place))

    def add_mass(self, place: Place, mass_kg: float) -> None:
        """Fix a point mass to the structure."""
        for row in self.structure.translations(place):
            self.M = with_square(self.M, mass_kg, self.pad(row))

    def add_spring(self, place: Place, stiffness_N_per_m: float) -> None:
        """Tie a place to the ground in its direction."""
        self.K0 = with_square(self.K0, stiffness_N_per_m, self.row(place))

    def add_damper(self, place: Place, damping_Ns_per_m: float) -> None:
        """The same by a viscous damper."""
        self.C = with_square(self.C, damping_Ns_per_m, self.row(place))

    def append_resonator(self, place: Place, mass_kg: float, frequency_Hz: float, damping_ratio: float) -> None:
        """Hang a mass on a spring and a dashpot at a place, moving in its direction."""
        w = 2 * np.pi * frequency_Hz
        row = np.concatenate([self.row(place), [-1.0]])
        self.M = with_coordinate(self.M, mass_kg)
        self.K0 = with_square(with_coordinate(self.K0), mass_kg * w**2, row)
        self.C = with_square(with_coordinate(self.C), 2 * damping_ratio * w * mass_kg, row)
        self.K_E, self.K_G = ([with_coordinate(A) for A in layers] for layers in (self.K_E, self.K_G))


@dataclass(frozen=True, eq=False)
class Element:
    """A nonlinear element on a row of the matrices' coordinates.

    `velocity` makes the coordinate the row's time derivative (the law then may read the displacement).  `follows` tells
    which drift scales it: that of the modulus E' of `joint`, that of all moduli, or none.
    """

    row: Array
    law: Law
    scale: float = 1.0
    velocity: bool = False
    follows: str = ""
    joint: int = 0


@dataclass
class JointPlan:
    """A joint as the truth has it."""

    name: str
    E: float
    G: float
    """Moduli of its layer, N/m2."""
    law: JointLaw | None = None
    """None takes the rig file's or the default."""
    law_changes: list[Callable[[JointLaw, float], JointLaw]] = field(default_factory=list)
    """Called in order with the law and E'."""
    gradient: float = 0.0
    """How much E' and G' fall along the layer, evenly about its middle, as a share of their value there."""
    rate_per_s: float = 0.0
    """Relative loss of E' per second."""
    sliders: list[tuple[int, Law]] = field(default_factory=list)
    """Friction elements on the slip of the layer's points, counted from where it begins."""


@dataclass
class Plan:
    """A rig as the truth has it.  Effects change `rig` and `layout` first, then matrices, elements and instruments."""

    rig: Rig
    """As the experimenter believes, then as it is."""
    layout: Layout
    """Its parts and supports on the bench's mesh."""
    joints: list[JointPlan]
    instruments: dict[str, InstrumentChannel]
    base_receptance: float = 0.0
    """Motion of the foundation per drive force, m/N."""
    moduli_rate_per_s: float = 0.0
    """Relative loss of all moduli per second."""
    clock_error: float = 0.0
    """Relative error of the converter's clock."""
    frequency_errors: Array = field(default_factory=lambda: np.zeros(0))
    """Relative, of the first natural frequencies that are not of rigid motions: half of those of modal stiffnesses."""
    matrix_changes: list[Callable[[Matrices], None]] = field(default_factory=list)
    element_makers: list[Callable[[Matrices], list[Element]]] = field(default_factory=list)
    """Called in order with the matrices."""

    def instrument(self, channel: str) -> InstrumentChannel:
        """The channel's signal path.

        ValueError if the rig has no such channel.
        """
        if channel not in self.instruments:
            raise ValueError(f"no channel {channel!r}; the rig has {', '.join(self.instruments)}")
        return self.instruments[channel]

    @property
    def drive_place(self) -> Place:
        """Where the force cell sits and the shaker drives."""
        return self.rig.place_of(self.rig.force_sensor.channel)

    def joint(self, name: str = "") -> JointPlan:
        """The joint of that name, which may be left out where there is one.

        ValueError if there is none of that name, or several and no name.
        """
        found = [joint for joint in self.joints if name in ("", joint.name)]
        if len(found) != 1:
            names = ", ".join(joint.name for joint in self.joints) or "none"
            raise ValueError(f"no joint {name!r}; the rig has {names}" if name else f"which joint: {names}?")
        return found[0]

    def beam(self, name: str) -> BeamPart:
        """The beam of that name.

        ValueError if the rig has no such beam.
        """
        try:
            return self.layout.beam(name)
        except KeyError:
            names = ", ".join(part.name for part in self.layout.beams) or "none"
            raise ValueError(f"no beam {name!r}; the rig has {names}") from None

    def place(
        self, *, position_m: float | None = None, part: str = "", node: float | None = None, direction: str = ""
    ) -> Place:
        """Where an effect acts: metres along the structure, metres along a part, or a part's node.

        Parameters
        ----------
        direction
            ``+x`` and so on; across the beam where it is left out, and `+y` at a node.

        Raises
        ------
        ValueError
            If there is no such place.
        """
        if part and part not in {p.name for p in self.layout.parts}:
            raise ValueError(f"no part {part!r}; the rig has {', '.join(p.name for p in self.layout.parts)}")
        if part and node is not None:
            if part in {beam.name for beam in self.layout.beams}:
                raise ValueError(f"{part!r} is a beam and has no nodes; give position_m")
            place = Place(part, float(node), (0.0, 1.0, 0.0))
        elif position_m is None:
            raise ValueError("an effect at a place needs position_m, with part in a rig of several, or part and node")
        elif part:
            beam = self.beam(part)
            if not 0 <= position_m <= beam.length + 1e-9:
                raise ValueError(f"position {position_m} m is not on {part!r}, which is {beam.length:.6g} m long")
            place = Place(part, min(position_m, beam.length), beam.normal)
        else:
            place = self.layout.place(position_m)
        return place.towards(unit_vector(direction)) if direction else place

    def move_sensor(self, channel: str, offset_m: float) -> None:
        """Shift a sensor (or, for the force cell, the drive) along its beam.

        ValueError if there is no such channel, or its sensor sits at a node.
        """
        self.instrument(channel)
        place = self.rig.place_of(channel)
        if not any(self.layout.reach(place)):
            raise ValueError(f"{channel!r} sits at a node of {place.part!r}, and is moved along beams only")
        self.rig = self.rig.with_moved_sensor(channel, self.layout.moved(place, offset_m))
