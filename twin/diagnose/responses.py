"""Diagnosis from frequency responses alone: no force level, and so linear causes only."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from recordings.responses import Responses
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.cause import Cause
from twin.diagnose.diagnose import HeldOutData, diagnose_evidence, notes_on
from twin.diagnose.effects import with_effects
from twin.diagnose.models import CAUSES
from twin.diagnose.selection.search import Report
from twin.diagnose.sound_data import SoundData
from twin.identify.measured_data import MeasuredData
from twin.identify.responses import gather_responses
from twin.rigs import Rig


def diagnose_responses(
    files: Sequence[Responses],
    rig: Rig,
    *,
    preload: str | None = None,
    scatter: float | None = None,
    source: str = "rig",
    out: Path | None = None,
    causes: Mapping[str, Cause] = CAUSES,
    thorough: bool = False,
    report: Report = lambda text: None,
) -> Diagnosis:
    """Say what a rig's model gets wrong about frequency responses of one state.

    Parameters
    ----------
    scatter
        See :func:`~twin.identify.responses.gather_responses`; others as :func:`~twin.diagnose.diagnose.diagnose`.

    Raises
    ------
    InputError
        As :func:`~twin.identify.responses.gather_responses`, or if an effect of the rig file is none.
    """
    begun = time.perf_counter()
    report("reducing the frequency responses")
    found = gather_responses(files, rig, preload=preload, scatter=scatter)
    evidence, told = with_effects(found.evidence, source=source), found.notes
    seen, unseeable = _by_force_level(evidence, causes)
    names = ", ".join(one.cause for one in unseeable)
    first = f"frequency responses alone have no force level and no time: linear causes only, not {names}"
    return diagnose_evidence(
        SoundData(evidence, (), None), HeldOutData(), causes=seen, out=out, notes=(first, *told, *notes_on(rig)),
        begun=begun, thorough=thorough, unseeable=unseeable, report=report,
    )  # fmt: skip


def _by_force_level(
    evidence: MeasuredData, causes: Mapping[str, Cause]
) -> tuple[dict[str, Cause], tuple[Exclusion, ...]]:
    """Causes that change a frequency response at any level, and limits that say nothing of all others."""
    seen, unseeable = {}, []
    for name, cause in causes.items():
        label = next(iter(cause.labels(evidence)), None)
        if label is None:
            continue  # the rig has no place for it
        acts = cause.begun(evidence, label)
        if acts.nonlinear or acts.opening or acts.layer_drift_per_s or acts.beam_drift_per_s:
            unseeable.append(Exclusion(name, cause.parameters(evidence, label)[0].name, None, {}))
        else:
            seen[name] = cause
    return seen, tuple(unseeable)
