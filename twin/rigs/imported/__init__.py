"""A rig file from another program's matrices: units, rows and places, joints, and the text of the file."""

from pathlib import Path

from twin.rigs.imported.make import Imported, ImportRequest, imported_rig
from twin.rigs.imported.part import PartFiles
from twin.rigs.imported.units import UNITS

EXAMPLE = Path(__file__).parent / "example"
"""A small model of CalculiX's, with what it wrote."""
