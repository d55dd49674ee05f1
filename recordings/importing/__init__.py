"""Recordings from anybody's files: columns, units, sample rate and steps, found or asked for once."""

from recordings.importing.imported import Imported, import_files
from recordings.importing.mapping import Mapping, mapping_beside, read_mapping

__all__ = ["Imported", "Mapping", "import_files", "mapping_beside", "read_mapping"]
