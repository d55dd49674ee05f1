"""The demonstration: a case drawn by chance, and the runs that look into it."""

from twin.demo.case import DemoCase, draw_demo_case
from twin.demo.plan import BROADBAND, HELD_OUT, SWEEPS, broadband, planned_sweeps, recording_names, resonance
