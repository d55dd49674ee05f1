"""Pictures: runs and diagnoses in rerun, live or recorded, figures, and the report."""
