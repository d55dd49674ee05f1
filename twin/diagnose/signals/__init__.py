"""Faults that show in the samples themselves: each is looked for before any model is asked."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from recordings.container.stored import with_samples
from recordings.run import Run
from twin.cause_registry import FINDINGS
from twin.diagnose.signals.clock import as_known, with_clock
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.sidebands import Sidebands, find_sidebands, loudest_Hz
from twin.diagnose.signals.unsettled import find_unsettled
from twin.identify.spectra.sine_fit import Line


def inspect_signals(runs: Sequence[Run]) -> list[Finding]:
    """Everything that the samples show by themselves; dwells are judged after the sines are fitted."""
    return [finding for find in FINDINGS.values() for finding in find(runs)]


def mended(run: Run, findings: Sequence[Finding]) -> Run:
    """The run with spoilt samples marked as missing, so that no fit uses them, and its clock set right."""
    devices = dict(run.devices)
    for finding in findings:
        positions = finding.spoilt.get(run.path)
        channel = finding.names.get("channel", "")
        if positions is None or channel not in run.channels:
            continue
        device = devices[run.device_of(channel).device]
        samples = with_samples(device.values[channel], positions, np.full(len(positions), np.nan, np.float32))
        devices[device.device] = replace(device, values={**device.values, channel: samples})
    whole = replace(run, devices=devices)
    for finding in findings:
        if finding.cause == "sample-clock":
            whole = with_clock(whole, error_ppm=finding.values["error_ppm"])
    return whole


def foreign_lines(findings: Sequence[Finding]) -> dict[str, Line]:
    """Lines by channel that no excitation made."""
    return {
        finding.names["channel"]: Line(finding.values["frequency_Hz"], finding.values["amplitude"])
        for finding in findings
        if finding.cause == "mains-hum"
    }
