"""Whether samples and time stamps go together."""

import numpy as np

from recordings.run import DeviceSamples, Run
from recordings.sweeps import sweeps
from twin.checks.finding import Finding
from twin.checks.responses import LEAST_SAMPLES
from twin.checks.sines import look_at_sines
from twin.checks.thresholds import RATE_ERROR
from twin.checks.units import factor_text


def look_at_clock(run: Run, *, force: str) -> list[Finding]:
    """One finding at most: whatever the clock is wrong by shows in all that follows."""
    for device in run.devices.values():
        finding = _rate(run, device)
        if finding is not None:
            return [finding]
    measured = [stretch for sweep in sweeps(run) for stretch in sweep.stretches]
    device = run.device_of(force)
    counts = [device.position_at(one.stop_ns) - device.position_at(one.start_ns) for one in measured]
    if measured and sum(count < LEAST_SAMPLES for count in counts) > len(measured) / 2:
        first, last = measured[0].start_ns * 1e-9, measured[-1].start_ns * 1e-9
        begun, ended = int(device.block_time_ns[0]) * 1e-9, device.end_ns * 1e-9
        expected = f"steps within the samples' time, which is {begun:.4g} to {ended:.4g} s"
        found = f"steps from {first:.4g} to {last:.4g} s, most of them without samples"
        return [Finding(run.path, "", "clock", expected, found, "stopped")]
    return look_at_sines(run, force=force)


def _rate(run: Run, device: DeviceSamples) -> Finding | None:
    """The stated rate against the one that the blocks' time stamps make."""
    apart_ns = np.diff(device.block_time_ns)
    if not np.any(apart_ns > 0):
        return None
    rate = float(np.median(np.diff(device.block_start)[apart_ns > 0] / (apart_ns[apart_ns > 0] * 1e-9)))
    stated = device.sample_rate_Hz
    if rate <= 0 or abs(rate / stated - 1) < RATE_ERROR:
        return None
    expected = f"{rate:.4g} samples a second, as the blocks' time stamps say"
    found = f"device {device.device} states {stated:.4g} Hz{factor_text(stated / rate)}"
    return Finding(run.path, "", "clock", expected, found, "stopped")
