"""Hidden causes, one a folder: what each does on the bench, how a diagnosis models it, how large it usually is."""

from twin.causes.dice import Dice
from twin.causes.outside import OutsideCause, load_causes
from twin.causes.registry import DRAWS, FINDINGS, NAMES, Registered

__all__ = ["DRAWS", "FINDINGS", "NAMES", "Dice", "OutsideCause", "Registered", "load_causes"]
