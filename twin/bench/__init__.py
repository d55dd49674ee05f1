"""The virtual rig: physics that streams, through its instruments, with or without a hidden cause."""

from twin.bench.bench import Bench, SAMPLE_RATES_Hz, open_bench
from twin.bench.effects import EFFECTS
from twin.bench.layer import JointLaw, default_law, no_law

__all__ = ["EFFECTS", "Bench", "JointLaw", "SAMPLE_RATES_Hz", "default_law", "no_law", "open_bench"]
