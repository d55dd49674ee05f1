"""Rehearsals: a procedure run on the twin, judged, improved and run again."""

from twin.rehearsal.branches import PredictedBranch, predicted_branches
from twin.rehearsal.improve import improved_procedure
from twin.rehearsal.nominal import NominalRig
from twin.rehearsal.rehearsal import Caution, Rehearsal, SweepSummary
from twin.rehearsal.rehearse import Rehearsed, judge, open_twin, rehearse, rehearse_until_clear
from twin.rehearsal.tables import branch_tables, rehearsed_table, result_table

__all__ = [
    "Caution",
    "NominalRig",
    "PredictedBranch",
    "Rehearsal",
    "Rehearsed",
    "SweepSummary",
    "branch_tables",
    "improved_procedure",
    "judge",
    "open_twin",
    "predicted_branches",
    "rehearse",
    "rehearse_until_clear",
    "rehearsed_table",
    "result_table",
]
