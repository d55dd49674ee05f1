"""Running a procedure on a source of samples, recording it, and saying what to know before the real run."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from recordings import InputError, RunWriter
from recordings.errors import blamed_on
from recordings.streams import Acquisition, SampleSource
from twin.bench import BenchSetup, drive_limits, open_bench
from twin.procedures import (
    DirectAcquisition,
    Impact,
    Procedure,
    RunSink,
    StepResult,
    check_channels,
    check_rate,
    dump_procedure,
    run_procedure,
)
from twin.rehearsal.checks import CHECKS
from twin.rehearsal.gather import gathered
from twin.rehearsal.hammer import hammered_twin
from twin.rehearsal.improve import improved_procedure
from twin.rehearsal.nominal import NominalRig
from twin.rehearsal.rehearsal import Caution, Rehearsal
from twin.rigs import Rig


@dataclass(frozen=True, kw_only=True)
class Rehearsed:
    """A rehearsal with its recording and its cautions, the gravest first."""

    rehearsal: Rehearsal
    recording: Path
    cautions: tuple[Caution, ...]

    @property
    def clear(self) -> bool:
        """Done, with notes at most."""
        return self.rehearsal.result.state == "done" and all(caution.severity == "note" for caution in self.cautions)

    @property
    def remaining(self) -> tuple[str, ...]:
        """The kinds of the cautions that are more than notes."""
        return tuple(dict.fromkeys(caution.kind for caution in self.cautions if caution.severity != "note"))

    @property
    def must_not_run(self) -> bool:
        """It did not get to its end, or a converter was overloaded."""
        return self.rehearsal.result.state == "aborted" or any(caution.severity == "stop" for caution in self.cautions)


def open_twin(
    rig: Rig, procedure: Procedure, *, preload: str, seed: int, source: str, named: str = "procedure"
) -> SampleSource:
    """The rig's bench at rest, with the channels that show its drive's limits.

    Parameters
    ----------
    source, named
        Names of the rig and of the procedure, for errors.

    Raises
    ------
    InputError
        If the rig cannot be built, or has not the channels or the rate that the procedure asks for.
    """
    with blamed_on(source):
        bench: SampleSource
        if isinstance(procedure, Impact):
            bench = hammered_twin(rig, procedure, preload=preload, seed=seed)
        else:
            bench = open_bench(
                rig, preload=preload, seed=seed, sample_rate_Hz=procedure.sample_rate,
                setup=BenchSetup(monitors=tuple(drive_limits(rig))),
            )  # fmt: skip
    check_channels(procedure, bench.channels, source=named)
    check_rate(procedure, bench.sample_rate_Hz, source=named)
    return bench


def judge(rehearsal: Rehearsal) -> tuple[Caution, ...]:
    """All cautions, the gravest first, causes before their consequences, one for all of a kind."""
    return gathered(caution for check in CHECKS for caution in check(rehearsal))


def rehearse(
    procedure: Procedure,
    source: SampleSource,
    recording: Path,
    *,
    nominal: NominalRig,
    progress: Callable[[float], None] | None = None,
    on_step: Callable[[StepResult], None] | None = None,
    watch: Callable[[Acquisition, RunSink], tuple[Acquisition, RunSink]] | None = None,
) -> Rehearsed:
    """Run a procedure on the twin and judge it.

    Parameters
    ----------
    source
        The bench, or any other source; at rest.
    recording
        The MCAP to write; replaced if it exists.
    progress, on_step
        As for :func:`twin.procedures.run_procedure`.
    watch
        Gives what is run in place of the acquisition and of the recording's sink: both, looked over the shoulder.

    Raises
    ------
    InputError
        If the rig has not what the procedure asks for, or its joint's law has no answer so far out, or the recording
        cannot be written.
    """
    check_channels(procedure, source.channels)
    info = {
        "source": "simulated",
        "stored": procedure.store,
        "rig": nominal.rig_name,
        "procedure": procedure.procedure,
        **({"drive": procedure.drive} if procedure.drive else {}),
        **nominal.preload,
    }
    attachments = {"rig.toml": nominal.rig_file} if nominal.rig_file else {}
    attachments["procedure.toml"] = dump_procedure(procedure)
    with RunWriter(
        recording, info=info, channels=list(source.channels), attachments=attachments, overwrite=True, reproducible=True
    ) as writer:
        acquisition: Acquisition = DirectAcquisition(source)
        sink: RunSink = writer
        if watch is not None:
            acquisition, sink = watch(acquisition, sink)
        try:
            result = run_procedure(procedure, acquisition, sink, progress=progress, on_step=on_step)
        except ArithmeticError as error:
            raise InputError(
                info["rig"], "joint", f"driven so far its law falls apart: {error}", "ask for less force"
            ) from error
    rehearsal = Rehearsal(
        procedure=procedure,
        result=result,
        channels={channel.name: channel for channel in source.channels},
        nominal=nominal,
    )
    return Rehearsed(rehearsal=rehearsal, recording=recording, cautions=judge(rehearsal))


def rehearse_until_clear(
    first: Rehearsed,
    make_source: Callable[[Procedure], SampleSource],
    recording: Path,
    *,
    rounds: int = 5,
    progress: Callable[[float], None] | None = None,
    on_step: Callable[[StepResult], None] | None = None,
    on_round: Callable[[Procedure], None] | None = None,
) -> Rehearsed | None:
    """Improve a procedure by its cautions and rehearse it again, until it is clear or nothing is left to improve.

    Parameters
    ----------
    make_source
        Gives a fresh rig at rest for the procedure of every round.
    recording
        The MCAP of the last round.
    progress, on_step
        As for :func:`rehearse`.
    on_round
        Called with every improved procedure before it is rehearsed.

    Returns
    -------
    Rehearsed or None
        The last round, :attr:`~Rehearsed.clear` or with what is :attr:`~Rehearsed.remaining`; None if there was
        nothing to improve.
    """
    latest: Rehearsed | None = None
    current, nominal = first, first.rehearsal.nominal
    for _ in range(rounds):
        if current.clear or current.rehearsal.result.state == "interrupted":
            break
        better = improved_procedure(current.rehearsal.procedure, current.cautions)
        if better is None:
            break
        if on_round is not None:
            on_round(better)
        latest = current = rehearse(
            better, make_source(better), recording, nominal=nominal, progress=progress, on_step=on_step
        )
    return latest
