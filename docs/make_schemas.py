"""JSON Schemas of the TOML files that people write, from the models that read them: ``python docs/make_schemas.py``.

Editors that know schemas complete and check with them what no reader has seen yet.  What one field says of another, a
layer's height of its beams' thickness for one, is checked where the file is read, not here.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from drivers.instruments import Instruments
from recordings.importing.mapping import Mapping
from twin.procedures.kinds import Procedure
from twin.rigs.beam import BeamRig
from twin.rigs.lap_joint import LapJointRig
from twin.rigs.modal import ModalRig
from twin.rigs.structure_rig import StructureRig
from twin.rigs.substructures import SubstructuresRig

FOLDER = Path(__file__).parent / "schemas"
FILES: dict[str, tuple[str, Any]] = {
    "rig-1": ("A rig of format 1: two beams, one lap joint", LapJointRig),
    "rig-2": ("A rig of format 2: any structure", StructureRig),
    "rig-beam": ("A beam alone", BeamRig),
    "rig-modal": ("One measured mode", ModalRig),
    "rig-substructures": ("Parts known by their responses beside parts by models", SubstructuresRig),
    "procedure": ("A procedure", Annotated[Procedure, Field(discriminator="procedure")]),
    "mapping": ("What twin import cannot know of a foreign file", Mapping),
    "instruments": ("Where the instruments are, and what hangs on their channels", Instruments),
}
"""Title and model by the schema's name."""


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema of one kind of file."""
    title, model = FILES[name]
    made = TypeAdapter(model).json_schema(by_alias=True)
    if "discriminator" in made:  # pydantic lets the field that tells the kinds apart be left out
        made["required"] = [made["discriminator"]["propertyName"]]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made, "title": title}


def text(name: str) -> str:
    """As it is written."""
    return json.dumps(schema(name), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for each in FILES:
        (FOLDER / f"{each}.json").write_text(text(each), encoding="utf-8")
