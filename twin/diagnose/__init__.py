"""Diagnosis: what the model gets wrong, by which cause, and what naming it gains."""

from twin.diagnose.answer.result import Diagnosis, NamedCause
from twin.diagnose.diagnose import diagnose, diagnose_data
from twin.diagnose.models import CAUSES
from twin.diagnose.options import DiagnosisOptions
from twin.diagnose.parallel_map import in_processes, usual_processes
from twin.diagnose.responses import responses_data

__all__ = [
    "CAUSES", "Diagnosis", "DiagnosisOptions", "NamedCause", "diagnose", "diagnose_data", "in_processes",
    "responses_data", "usual_processes",
]  # fmt: skip
