"""A run's steps as sweeps: which stretch of time belongs to which step."""

from collections.abc import Iterator
from dataclasses import dataclass

from recordings.run import Run, Step, StepState


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """The time in which one step was measured: from `start_ns` to before `stop_ns`."""

    step: Step
    """The step's message with state MEASURING."""
    start_ns: int
    stop_ns: int
    """From that message to the next one of any state, or to the end of the samples."""
    settle_start_ns: int | None
    """Where the settling before it begins in the file, up to `start_ns`; None if the run does not tell."""
    wait_s: float | None
    """How long was waited for settling; None if the run does not tell, which is also so for a run that stored only
    settled stretches (``stored`` = ``settled``): what the file holds before `start_ns` is not the wait then."""
    ended_by: StepState | None
    """State of the message that ended it; None if the samples ended first (a file that was cut, a test broken off)."""


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """One sweep of a run, its measured stretches in order of time.

    `state` is DONE or ABORTED as the procedure said at its end, None if it never came to that.
    """

    name: str
    stretches: tuple[Stretch, ...]
    state: StepState | None


def sweeps(run: Run) -> Iterator[Sweep]:
    """The sweeps of a run in the order in which they began; also those in which nothing was measured."""
    names = dict.fromkeys(step.sweep for step in run.steps)
    stretches: dict[str, list[Stretch]] = {name: [] for name in names}
    ends: dict[str, StepState] = {}
    end_ns = max((device.end_ns for device in run.devices.values()), default=0)
    all_stored = run.info.get("stored", "all") == "all"
    for position, step in enumerate(run.steps):
        if step.state in (StepState.DONE, StepState.ABORTED):
            ends[step.sweep] = step.state
        if step.state is not StepState.MEASURING:
            continue
        following = run.steps[position + 1] if position + 1 < len(run.steps) else None
        settle_start = _settle_start(run.steps[position - 1] if position else None, step)
        waited = settle_start is not None and all_stored
        stretches[step.sweep].append(
            Stretch(
                step=step,
                start_ns=step.time_ns,
                stop_ns=following.time_ns if following else max(end_ns, step.time_ns),
                settle_start_ns=settle_start,
                wait_s=(step.time_ns - settle_start) * 1e-9 if waited and settle_start is not None else None,
                ended_by=following.state if following else None,
            )
        )
    for name in names:
        yield Sweep(name=name, stretches=tuple(stretches[name]), state=ends.get(name))


def measured_stretches(run: Run) -> list[Stretch]:
    """All that was measured in a run, sweep by sweep."""
    return [stretch for sweep in sweeps(run) for stretch in sweep.stretches]


def _settle_start(before: Step | None, step: Step) -> int | None:
    """Time of the SETTLING message that leads to a measured step: the one just before it, of the same step."""
    if before is None or before.state is not StepState.SETTLING:
        return None
    return before.time_ns if (before.sweep, before.index) == (step.sweep, step.index) else None
