"""What a diagnosis begins from, of frequency responses alone: no force level, and so linear causes only."""

import time
from collections.abc import Mapping, Sequence

from recordings.responses import Responses
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.cause import Cause
from twin.diagnose.diagnose import DiagnosedData, notes_on
from twin.diagnose.effects import with_effects
from twin.diagnose.models import CAUSES
from twin.diagnose.selection.search import Report
from twin.diagnose.sound_data import SoundData
from twin.identify.measured_data import MeasuredData
from twin.identify.responses import gather_responses
from twin.rigs import Rig


def responses_data(
    files: Sequence[Responses],
    rig: Rig,
    *,
    preload: str | None = None,
    scatter: float | None = None,
    source: str = "rig",
    causes: Mapping[str, Cause] = CAUSES,
    report: Report = lambda text: None,
) -> DiagnosedData:
    """Reduce frequency responses of one state to what a diagnosis begins from.

    Parameters
    ----------
    scatter
        See :func:`~twin.identify.responses.gather_responses`.
    source
        Names the rig in errors.
    causes
        What may be named.

    Raises
    ------
    InputError
        As :func:`~twin.identify.responses.gather_responses`, or if an effect of the rig file is none.
    """
    begun = time.perf_counter()
    report("reducing the frequency responses")
    found = gather_responses(files, rig, preload=preload, scatter=scatter)
    evidence, told = with_effects(found.evidence, source=source), found.notes
    unseeable = _unseeable(evidence, causes)
    names = ", ".join(one.cause for one in unseeable)
    first = f"frequency responses alone have no force level and no time: linear causes only, not {names}"
    return DiagnosedData(
        sound=SoundData(evidence, (), None), notes=(first, *told, *notes_on(rig)), unseeable=unseeable, begun=begun
    )


def _unseeable(evidence: MeasuredData, causes: Mapping[str, Cause]) -> tuple[Exclusion, ...]:
    """Limits that say nothing, of all causes but those that change a frequency response at any level."""
    unseeable = []
    for name, cause in causes.items():
        label = next(iter(cause.labels(evidence)), None)
        if label is None:
            continue  # the rig has no place for it
        acts = cause.begun(evidence, label)
        if acts.nonlinear or acts.opening or acts.layer_drift_per_s or acts.beam_drift_per_s:
            unseeable.append(Exclusion(name, cause.parameters(evidence, label)[0].name, None, {}))
    return tuple(unseeable)
