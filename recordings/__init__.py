"""Runs on disk: channels, sample blocks, steps and events in MCAP.  No physics, no hardware."""

from recordings.errors import InputError
from recordings.limits import Limits
from recordings.reader import read_run
from recordings.run import Channel, DeviceSamples, Event, Gap, Indicator, Run, SampleBlock, Step, StepState
from recordings.sweeps import Stretch, Sweep, sweeps
from recordings.writer import RunWriter

__all__ = [
    "Channel",
    "DeviceSamples",
    "Event",
    "Gap",
    "Indicator",
    "InputError",
    "Limits",
    "Run",
    "RunWriter",
    "SampleBlock",
    "Step",
    "StepState",
    "Stretch",
    "Sweep",
    "read_run",
    "sweeps",
]
