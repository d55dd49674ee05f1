"""Pictures: runs and diagnoses in rerun, live or recorded, figures, and the report."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.views.answer import answer_markdown
    from twin.views.rehearsal_report import write_rehearsal_report
    from twin.views.report import write_report
    from twin.views.rerun_diagnosis import save_diagnosis
    from twin.views.rerun_run import save_run
    from twin.views.rerun_table import save_table

__all__ = ["answer_markdown", "save_diagnosis", "save_run", "save_table", "write_rehearsal_report", "write_report"]

_FILES = {
    "answer_markdown": "answer",
    "save_diagnosis": "rerun_diagnosis",
    "save_run": "rerun_run",
    "save_table": "rerun_table",
    "write_rehearsal_report": "rehearsal_report",
    "write_report": "report",
}


def __getattr__(name: str) -> Any:
    # Imported when asked for: the live view's process starts in a second, which identification alone takes to import.
    if name not in _FILES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_FILES[name]}"), name)
