"""Runs, rigs and diagnoses in the rerun viewer."""
