"""Pictures: runs and diagnoses in rerun, live or recorded, figures, and the report."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twin.views.rehearsal_report import rehearsal_page
    from twin.views.report import diagnosis_page
    from twin.views.rerun_diagnosis import save_diagnosis
    from twin.views.rerun_run import save_run
    from twin.views.rerun_table import save_table

__all__ = ["diagnosis_page", "rehearsal_page", "save_diagnosis", "save_run", "save_table"]

_FILES = {
    "diagnosis_page": "report",
    "rehearsal_page": "rehearsal_report",
    "save_diagnosis": "rerun_diagnosis",
    "save_run": "rerun_run",
    "save_table": "rerun_table",
}


def __getattr__(name: str) -> Any:
    # Imported when asked for: the live view's process starts in a second, which identification alone takes to import.
    if name not in _FILES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_FILES[name]}"), name)
