"""A rig as data, whatever its structure: what every program of the twin asks of a rig file.  SI units throughout."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

from pydantic import Field, model_validator

from recordings.errors import InputError
from recordings.toml_input import Name, Table
from twin.rigs.layout import Layout, Place, ThinLayer
from twin.rigs.tables import (
    Acquisition,
    Damping,
    Drift,
    Effect,
    Measured,
    NaturalFrequencies,
    Shaker,
    Transducer,
)


class Rig(Table, ABC):
    """A rig as an experimenter describes it, or as a diagnosis extended it (`effect`).

    The files' formats are its subclasses: :class:`twin.rigs.lap_joint.LapJointRig` and
    :class:`twin.rigs.structure_rig.StructureRig`.
    """

    if TYPE_CHECKING:
        sensor: Sequence[Transducer]
        """In the file's order."""
    name: Name
    damping: Damping
    acquisition: Acquisition = Acquisition()
    drift: Drift = Drift()
    natural_frequencies: NaturalFrequencies = NaturalFrequencies()
    measured: dict[str, Measured] = Field(default={})
    effect: list[Effect] = Field(default=[])

    @model_validator(mode="after")
    def _measured(self) -> Self:
        unique("sensor channels", [sensor.channel for sensor in self.sensor])
        if not any(sensor.quantity == "force" for sensor in self.sensor):
            raise ValueError("one sensor must measure force")
        return self

    @abstractmethod
    def layout(self, *, beam_elements: int | None = None, layer_elements: int | None = None) -> Layout:
        """Parts, supports, joints and ties, meshed as the file says or with other numbers of elements."""

    @abstractmethod
    def bench_layout(self) -> Layout:
        """The same on the bench's own mesh, which no inference shares."""

    @property
    @abstractmethod
    def shaker(self) -> Shaker:
        """The one that drives, the first of several."""

    @property
    @abstractmethod
    def drive_place(self) -> Place:
        """Where it drives, and in which direction."""

    @property
    def drives(self) -> dict[str, Place]:
        """Where a shaker may drive through a force cell, by name; the one that does comes first."""
        return {"drive": self.drive_place}

    @property
    def force_cells(self) -> dict[str, str]:
        """Channels of the force cells by their drives' names."""
        return {"drive": self.force_sensor.channel}

    def driven_by(self, drive: str | None) -> Self:
        """The same rig with the shaker of that name driving; as it is for None.

        InputError if it has none of that name with a force cell.
        """
        if drive not in (None, *self.force_cells):
            has = f"the rig has {', '.join(self.force_cells)}"
            raise InputError(self.name, "drive", f"no drive {drive!r} with a force cell", has)
        return self

    @abstractmethod
    def place_of(self, channel: str) -> Place:
        """Where a sensor is and in which direction it measures; KeyError for a channel that is none of the rig's."""

    @abstractmethod
    def with_joints(self, joints: Sequence[ThinLayer]) -> Self:
        """The same rig with these joints' preloads and laws."""

    @abstractmethod
    def with_moved_sensor(self, channel: str, place: Place) -> Self:
        """The same rig with a sensor elsewhere."""

    @abstractmethod
    def hit_at(self, place: Place) -> Self:
        """The same rig with its shakers and force cells taken off, and hit there by a hammer that has a force cell.

        ValueError if there is no such place.
        """

    @property
    def joints(self) -> tuple[ThinLayer, ...]:
        """In the file's order."""
        return self.layout().joints

    @property
    def force_sensor(self) -> Transducer:
        """The force cell of the driving shaker."""
        return next(s for s in self.sensor if s.quantity == "force")

    @property
    def response_sensors(self) -> list[Transducer]:
        """All sensors but force cells, in the file's order."""
        return [s for s in self.sensor if s.quantity != "force"]

    @property
    def sentence(self) -> str:
        """What it is made of and what holds it, in words."""
        layout = self.layout()
        parts = ", ".join(part.name for part in layout.parts)
        joints = ", ".join(f"{joint.name} between {' and '.join(joint.between)}" for joint in layout.joints)
        held = ", ".join(f"{s.part} held at {s.at:g}" for s in layout.supports) or "hung free"
        return f"{parts}; {f'joined by {joints}' if joints else 'no joint'}; {held}"


def unique(what: str, names: Sequence[str]) -> None:
    """Raise ValueError where a name comes twice."""
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ValueError(f"{what} must be unique, got {', '.join(twice)} more than once")
