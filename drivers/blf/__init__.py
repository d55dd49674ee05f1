"""Logs of the node's CAN FD frames in Vector's BLF: a run to frames and back."""

from drivers.blf.reading import read_blf
from drivers.blf.writing import write_blf

__all__ = ["read_blf", "write_blf"]
