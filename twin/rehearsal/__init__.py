"""Rehearsals: a procedure run on the twin, judged, improved and run again."""

from twin.rehearsal.branches import predicted_branches
from twin.rehearsal.nominal import NominalRig
from twin.rehearsal.rehearsal import Caution, Rehearsal
from twin.rehearsal.rehearse import Rehearsed, judge, open_twin, rehearse, rehearse_until_clear
from twin.rehearsal.tables import branch_tables, rehearsed_table, result_table
