"""Diagnosis: what the model gets wrong, by which cause, and what naming it gains."""

from twin.diagnose.diagnose import diagnose
from twin.diagnose.models import CAUSES
from twin.diagnose.result import Diagnosis, NamedCause
from twin.diagnose.side_by_side import in_processes, usual_processes

__all__ = ["CAUSES", "Diagnosis", "NamedCause", "diagnose", "in_processes", "usual_processes"]
