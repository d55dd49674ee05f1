"""The virtual rig: physics that streams, through its instruments, with or without a hidden cause."""

from twin.bench.bench import Bench, BenchSetup, assembled, drive_limits, open_bench
from twin.bench.effects import EFFECTS
from twin.bench.hidden import FIRST_CAUSES, HiddenCase, draw_case
from twin.bench.hits import HammeredBench, Hit
from twin.bench.layer import JointLaw, no_law, steel_law
from twin.bench.planned import check_effects
