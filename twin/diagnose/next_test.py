"""The measurement that would tell rival causes apart: the evidence again, where they differ, with less noise."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from recordings.run import Run
from twin.diagnose.candidate import Candidate, extension_of
from twin.diagnose.result import NextTest
from twin.diagnose.verdict import RIVAL, close_rivals
from twin.identify.evidence import Evidence
from twin.procedures import Procedure, Random, SteppedSine, save_procedure
from twin.procedures.tables import Measure, Settle

__all__ = ["plan_next_test"]

PROCEDURE = "next.toml"
MOST = 16.0
"""Longest measurement that is proposed, over the one that was made."""


def plan_next_test(
    runs: Sequence[Run], evidence: Evidence, finalists: tuple[Candidate, ...], out: Path
) -> NextTest | None:
    """Write a procedure that separates the best model from its closest rival.

    The gap of log evidence between two models grows with the time measured; where the noise of one channel limits it,
    so does their difference.  Linear rivals differ over the whole band, nonlinear ones at the largest amplitudes.

    Parameters
    ----------
    runs
        The recordings, for the force that was used.
    finalists
        Models of the last stage, best first.
    out
        Folder for the procedure.
    """
    rivals = close_rivals(finalists)
    if not rivals:
        return None
    best, rival = finalists[0], rivals[0]
    gap = max(best.weight(best.chi2_per_dof) - rival.weight(best.chi2_per_dof), RIVAL / MOST)
    longer = float(np.clip(2 * RIVAL / gap, 2.0, MOST))
    nonlinear = any(extension_of(evidence, model.blames[-1:]).nonlinear for model in (best, rival))
    procedure = _sweep(evidence, longer) if nonlinear and len(evidence.steps) else _noise(runs, evidence, longer)
    if procedure is None:
        return None
    save_procedure(procedure, out / PROCEDURE)
    names = [model.blames[-1].cause.name for model in (best, rival)]
    why = f"separates {names[0]} from {names[1]} by {longer:.0f} times the measuring time"
    return NextTest(why=why, procedure=PROCEDURE)


def _sweep(evidence: Evidence, longer: float) -> Procedure:
    """The largest sweep again, measured for longer."""
    states = evidence.steps.states
    largest = max(state.target_amplitude for state in states)
    frequencies = sorted({round(state.frequency_Hz, 4) for state in states if state.target_amplitude == largest})
    return SteppedSine(
        frequencies=frequencies,
        amplitudes=[largest],
        measure=Measure(seconds=float(np.round(longer, 1))),
        settle=Settle(tolerance=1e-4),
    )


def _noise(runs: Sequence[Run], evidence: Evidence, longer: float) -> Procedure | None:
    """The broadband run again, longer."""
    if not evidence.broadband:
        return None
    data = evidence.broadband[0]
    run = next(run for run in runs if run.path == data.run)
    device = next(d for d in run.devices.values() if evidence.force in d.values)
    force = device.values[evidence.force]
    return Random(
        band=(float(np.floor(data.frequency_Hz[0])), float(np.ceil(data.frequency_Hz[-1]))),
        rms=float(np.round(np.std(force[np.isfinite(force)]), 3)),
        duration=float(np.round(longer * len(force) / device.sample_rate_Hz)),
        sample_rate=float(device.sample_rate_Hz),
    )
