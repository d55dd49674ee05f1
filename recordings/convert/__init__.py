"""Recordings in the formats of other programs; each is read to a `Run` and written from one."""

from recordings.convert.mcap_run import write_mcap
from recordings.convert.registry import FORMATS, Format, convert, read_as
from recordings.convert.sep005 import from_sep005, to_sep005

__all__ = ["FORMATS", "Format", "convert", "from_sep005", "read_as", "to_sep005", "write_mcap"]
