"""A rehearsal as plain tables, for JSON and for the report."""

import cmath
from dataclasses import asdict
from typing import Any

from twin.procedures import Procedure, RingDown, SteppedSine, StepResult
from twin.rehearsal.branches import predicted_branches
from twin.rehearsal.noise import noise_tables
from twin.rehearsal.rehearse import Rehearsed
from twin.rehearsal.ring_down import free_decays
from twin.rehearsal.turns import transient_left
from twin.rigs import Rig
from twin.rigs.assumed import assumed

AS_MEASURED = (
    "sweep", "index", "frequency_Hz", "target_channel", "target_amplitude", "amplitude", "amplitude_error", "voltage_V",
    "settle_s", "measure_s", "settled", "remaining", "drift", "distortion",
)  # fmt: skip
"""What a table tells of a step as its result has it."""


def result_table(
    first: Rehearsed,
    better: Rehearsed | None,
    *,
    procedure: str,
    rig: Rig,
    preload: str,
    seed: int,
    branches: list[dict[str, Any]],
) -> dict[str, Any]:
    """All of a rehearsal: the procedure as asked for and, where it was improved, the better one.

    Of that also whether it cleared all warnings, or which kinds are left.
    """
    return {
        "procedure": procedure,
        "rig": rig.name,
        "preload": preload,
        "seed": seed,
        "assumed": list(assumed(rig)),
        **rehearsed_table(first),
        "branches": branches,
        "improved": None
        if better is None
        else {**rehearsed_table(better), "cleared": better.clear, "remaining": list(better.remaining)},
    }


def rehearsed_table(rehearsed: Rehearsed) -> dict[str, Any]:
    """Everything a reader of ``result.json`` needs; phasors as amplitude and phase relative to the force.

    Per step also: the force's error, the transient left in the measurement as a part of the response, the use of each
    channel's range and of each limit (1 is all of it).
    """
    rehearsal = rehearsed.rehearsal
    result = rehearsal.result
    return {
        "state": result.state,
        "reason": result.reason,
        "clear": rehearsed.clear,
        "must_not_run": rehearsed.must_not_run,
        "duration_s": result.duration_s,
        "sample_rate_Hz": result.sample_rate_Hz,
        "recording": rehearsed.recording.name,
        "warnings": [asdict(caution) for caution in rehearsed.cautions],
        "sweeps": [asdict(summary) for summary in rehearsal.summaries()],
        "decays": _decays(rehearsed),
        "noise": noise_tables(rehearsal, rehearsed.recording),
        "steps": [
            _step(rehearsed, step, before if before is not None and before.sweep == step.sweep else None)
            for before, step in zip([None, *result.steps], result.steps, strict=False)
        ],
    }


def _decays(rehearsed: Rehearsed) -> list[dict[str, Any]]:
    """Free decays of a ring-down, as its recording has them."""
    rehearsal = rehearsed.rehearsal
    if not isinstance(rehearsal.procedure, RingDown):
        return []
    return [asdict(decay) for decay in free_decays(rehearsal.result, rehearsed.recording, rehearsal.response_channels)]


def _step(rehearsed: Rehearsed, step: StepResult, before: StepResult | None) -> dict[str, Any]:
    rehearsal = rehearsed.rehearsal
    limits = rehearsal.procedure.limits
    peaks = {**rehearsal.nominal.drive_limits, **limits.peak}
    ranges = {name: channel.range for name, channel in rehearsal.channels.items() if channel.range}
    return {
        **{name: getattr(step, name) for name in AS_MEASURED},
        "transient": step.remaining if step.settled or not step.phasors else transient_left(rehearsal, step, before),
        "phasors": {
            name: {"amplitude": abs(phasor), "phase_rad": cmath.phase(phasor), "std": step.std.get(name)}
            for name, phasor in step.phasors.items()
        },
        "range_use": {name: step.peak[name] / limit for name, limit in ranges.items() if name in step.peak},
        "limit_use": {
            "voltage": step.voltage_V / limits.voltage,
            **{name: step.peak[name] / limit for name, limit in peaks.items() if name in step.peak},
        },
    }


def branch_tables(rig: Rig, *, preload: str | None, procedure: Procedure) -> list[dict[str, Any]]:
    """Amplitude and phase of each channel along all predicted curves.

    None unless the procedure steps through frequencies at a force.
    """
    if not isinstance(procedure, SteppedSine):
        return []
    return [
        {
            **asdict(branch),
            "response": {
                name: {"amplitude": list(map(abs, values)), "phase_rad": list(map(cmath.phase, values))}
                for name, values in branch.response.items()
            },
        }
        for branch in predicted_branches(rig, preload=preload, procedure=procedure)
    ]
