"""The list of causes, without their physics: names, draws, and where the parts of each are found."""

from twin.cause_registry.advice import advice_on
from twin.cause_registry.dice import Dice
from twin.cause_registry.outside import OutsideCause, load_causes
from twin.cause_registry.registry import DRAWS, FINDINGS, NAMES, Registered, from_folders
