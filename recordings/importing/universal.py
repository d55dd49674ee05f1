"""Universal files of analysers: time histories of data set 58, as `recordings.convert` reads them."""

from pathlib import Path

import numpy as np

from recordings.convert.uff import read_uff
from recordings.errors import InputError
from recordings.importing.signals import Signal


def read_universal(path: Path) -> list[Signal]:
    """All channels, in SI units, each device a table; raises InputError."""
    run = read_uff(path)
    if not run.devices:
        reason = next((event.detail for event in run.events if event.kind == "not-converted"), "it has none")
        raise InputError(path, "", f"holds no time history that can be a channel: {reason}")
    return [
        Signal(
            name=name, unit=run.channels[name].unit, values=np.asarray(values).astype(np.float64), table=device.device,
            sample_rate_Hz=_rounded(device.sample_rate_Hz), start_ns=int(device.block_time_ns[0]),
            position_m=run.channels[name].position_m, direction=run.channels[name].direction,
        )
        for device in run.devices.values()
        for name, values in device.values.items()
    ]  # fmt: skip


def _rounded(rate_Hz: float) -> float:
    """The rate that was set: a universal file's head has six digits of the interval."""
    rounded = float(f"{rate_Hz:.5g}")
    return rounded if abs(rounded / rate_Hz - 1) < 1e-6 else rate_Hz
