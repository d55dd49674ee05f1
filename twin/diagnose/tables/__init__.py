"""Diagnosis of tables: natural frequencies against a structure, sweeps against a smooth law of amplitude."""

from twin.diagnose.tables.felt import felt_causes
from twin.diagnose.tables.frequencies import diagnose_frequencies
from twin.diagnose.tables.result import FrequencyRow, SweepRow, TableDiagnosis
from twin.diagnose.tables.sweeps import diagnose_sweeps
