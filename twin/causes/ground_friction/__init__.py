"""Dry friction against the surroundings: a cable that drags, a probe that touches."""
