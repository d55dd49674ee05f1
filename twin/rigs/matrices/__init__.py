"""Matrices of other programs: one file for each format, and one that asks a file which it is."""

from twin.rigs.matrices.found import FoundMatrix
from twin.rigs.matrices.read import read_matrix
