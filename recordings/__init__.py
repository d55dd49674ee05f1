"""Runs on disk: channels, sample blocks, steps and events in MCAP.  No physics, no hardware."""

from recordings.check import CheckReport, check_run
from recordings.errors import InputError
from recordings.limits import Limits
from recordings.reader import read_run
from recordings.recover import RecoverReport, recover
from recordings.run import Channel, DeviceSamples, Event, Gap, Indicator, Run, SampleBlock, Step, StepState
from recordings.sweeps import Stretch, Sweep, sweeps
from recordings.tables import FrequencyTable, SweepTable, read_table
from recordings.whole import check_writable, refuse_existing, whole_file
from recordings.writer import RunWriter

__all__ = [
    "Channel", "CheckReport", "DeviceSamples", "Event", "FrequencyTable", "Gap", "Indicator", "InputError",
    "Limits", "RecoverReport", "Run", "RunWriter", "SampleBlock", "Step", "StepState", "Stretch", "Sweep",
    "SweepTable", "check_run", "check_writable", "read_run", "read_table", "recover", "refuse_existing", "sweeps",
    "whole_file",
]  # fmt: skip
