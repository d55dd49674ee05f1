"""Hidden causes, one a folder: what each does on the bench, and how a diagnosis models it."""

from twin.causes.dice import Dice
from twin.causes.outside import OutsideCause, load_causes
from twin.causes.registry import DRAWS, FINDINGS, NAMES, Registered, from_folders
