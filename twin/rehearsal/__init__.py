"""Rehearsals: a procedure run on the twin, judged, improved and run again."""

from twin.rehearsal.improve import improved_procedure
from twin.rehearsal.rehearsal import Caution, Rehearsal, SweepSummary
from twin.rehearsal.rehearse import Believed, Rehearsed, judge, rehearse, rehearse_until_clear
from twin.rehearsal.tables import rehearsed_table

__all__ = [
    "Believed",
    "Caution",
    "Rehearsal",
    "Rehearsed",
    "SweepSummary",
    "improved_procedure",
    "judge",
    "rehearse",
    "rehearse_until_clear",
    "rehearsed_table",
]
