"""Recordings in the formats of other programs; each is read to a `Run` and written from one."""

from recordings.convert.registry import FORMATS, Format, convert

__all__ = ["FORMATS", "Format", "convert"]
