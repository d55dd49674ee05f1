"""Recordings reduced without what their samples show to be faulty, against a rig with all that its file says.

Identification and diagnosis begin here alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from recordings.run import Run
from twin.diagnose.effects import with_effects
from twin.diagnose.signals import (
    Finding,
    Sidebands,
    as_known,
    find_sidebands,
    foreign_lines,
    inspect_signals,
    loudest_Hz,
    mended,
)
from twin.identify.measured_data import MeasuredData, gather_data
from twin.identify.rig_channels import own_channels
from twin.rigs import Rig


@dataclass(frozen=True)
class SoundData:
    """What a fit may use."""

    evidence: MeasuredData
    """The recordings, reduced."""
    findings: tuple[Finding, ...]
    """Faults that the samples show by themselves.  Spoilt samples were not used, hum was fitted beside the sines,
    and a wrong clock was set right."""
    sidebands: Sidebands | None
    """What no listed cause leaves in the samples."""


def sound_data(runs: Sequence[Run], rig: Rig, *, preload: str | None = None, source: str = "rig") -> SoundData:
    """Inspect, mend and reduce `runs`.

    Parameters
    ----------
    preload
        As for :func:`~twin.identify.measured_data.gather_data`.

    Raises
    ------
    InputError
        If the recordings do not fit the rig (:func:`~twin.identify.measured_data.gather_data`), or an effect of the rig
        file is none (:func:`~twin.diagnose.effects.with_effects`).
    """
    runs = [as_known(own_channels(run, rig), rig) for run in runs]
    findings = inspect_signals(runs)
    usable = [mended(run, findings) for run in runs]
    lines = foreign_lines(findings)
    evidence = gather_data(usable, rig, preload=preload, lines=lines)
    states = [*evidence.steps.states, *evidence.unsettled]
    sidebands = find_sidebands(
        usable, evidence.channels, lines, unsettled=evidence.unsettled,
        resonance_Hz=loudest_Hz(states, evidence.channels, force=evidence.force),
    )  # fmt: skip
    return SoundData(with_effects(evidence, source=source), tuple(findings), sidebands)
