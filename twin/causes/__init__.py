"""Hidden causes, one a folder: what each does on the bench, and how a diagnosis models it."""

from twin.cause_registry import Dice, OutsideCause, load_causes

__all__ = ["Dice", "OutsideCause", "load_causes"]
