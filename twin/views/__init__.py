"""Pictures: runs and diagnoses in rerun, figures, and the report."""

from twin.views.answer import answer_markdown
from twin.views.rehearsal_report import write_rehearsal_report
from twin.views.report import write_report
from twin.views.rerun_diagnosis import save_diagnosis
from twin.views.rerun_run import save_run

__all__ = ["answer_markdown", "save_diagnosis", "save_run", "write_rehearsal_report", "write_report"]
