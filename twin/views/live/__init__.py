"""A run in the rerun viewer while it happens."""
