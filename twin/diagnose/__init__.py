"""Diagnosis: what the model gets wrong, by which cause, and what naming it gains."""

from twin.diagnose.answer.result import Diagnosis, NamedCause
from twin.diagnose.diagnose import diagnose
from twin.diagnose.models import CAUSES
from twin.diagnose.parallel_map import in_processes, usual_processes
from twin.diagnose.responses import diagnose_responses
from twin.identify.time_limit import time_limit

__all__ = [
    "CAUSES", "Diagnosis", "NamedCause", "diagnose", "diagnose_responses", "in_processes", "time_limit",
    "usual_processes",
]  # fmt: skip
