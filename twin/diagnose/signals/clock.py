"""A run as a converter with a good clock would have recorded it."""

from dataclasses import replace

import numpy as np

from recordings.run import Run
from twin.rigs import Rig


def as_known(run: Run, rig: Rig) -> Run:
    """The run with what the rig file says of the converter's clock taken off, so that only the rest can be found."""
    error_ppm = rig.acquisition.clock_error_ppm
    return with_clock(run, error_ppm=error_ppm) if error_ppm else run


def with_clock(run: Run, *, error_ppm: float) -> Run:
    """The run as a converter with a good clock would have recorded it: more samples a second, and less time."""
    rate = 1 + error_ppm * 1e-6

    def sooner(time_ns: int) -> int:
        return round(time_ns / rate)

    devices = {
        name: replace(
            device,
            sample_rate_Hz=device.sample_rate_Hz * rate,
            block_time_ns=np.rint(device.block_time_ns / rate).astype(np.int64),
        )
        for name, device in run.devices.items()
    }
    steps = tuple(replace(step, time_ns=sooner(step.time_ns)) for step in run.steps)
    events = tuple(replace(event, time_ns=sooner(event.time_ns)) for event in run.events)
    return replace(run, devices=devices, steps=steps, events=events)
