"""A rig of one beam alone, ``kind = "beam"``: a specimen hung free or clamped, known by its natural frequencies."""

from typing import Annotated, Literal, Self

from pydantic import Field

from recordings.toml_input import Name, Table
from twin.rigs.lap_joint import Beam
from twin.rigs.rig import Rig
from twin.rigs.structure_rig import StructureRig
from twin.rigs.tables import Effect


class BeamRig(Table):
    """A uniform beam, what holds it, and, after a diagnosis, by what its model was extended (`effect`)."""

    kind: Literal["beam"]
    name: Name
    source: str = ""
    support: Literal["free", "clamped"] = "free"
    """Hung free, or clamped at x = 0."""
    beam: Beam
    elements: Annotated[int, Field(ge=8, le=400)] = 60
    effect: list[Effect] = Field(default=[])
    note: list[str] = Field(default=[])

    def structure(self) -> StructureRig:
        """The same as a structure of one part, struck at its end and read there without a mass."""
        beam = self.beam.model_dump()
        length, end = beam.pop("length"), {"part": self.name, "direction": "+y"}
        held = [{"part": self.name, "at": 0.0, "fix": ["x", "y", "rz"]}] if self.support == "clamped" else []
        part = {"name": self.name, "kind": "beam", "start": [0.0, 0.0], "end": [length, 0.0], **beam}
        # A structure's effects say on which part they sit.
        effects = [effect.model_dump() for effect in self.effect]
        for effect in effects:
            if "position_m" in effect["parameters"]:
                effect["parameters"]["part"] = self.name
        sensors = [{"channel": name, "quantity": name, "range": 1.0} for name in ("force", "acceleration")]
        return StructureRig.model_validate({
            "format": 2, "name": self.name, "part": [{**part, "elements": self.elements}], "support": held,
            "drive": [{**end, "at": length}], "sensor": [{**end, "at": length, **sensor} for sensor in sensors],
            "damping": {"modal_ratio": [0.01]}, "effect": effects,
        })  # fmt: skip

    def found(self, structure: Rig) -> Self:
        """The beam with what was found of its :meth:`structure`: modulus and effects."""
        modulus = next(part.youngs_modulus for part in structure.layout().beams)
        beam = self.beam.model_copy(update={"youngs_modulus": modulus})
        effects = [
            effect.model_copy(update={"parameters": {k: v for k, v in effect.parameters.items() if k != "part"}})
            for effect in structure.effect
        ]
        return self.model_copy(update={"beam": beam, "effect": effects})
