"""Running a procedure: the same code for a rehearsal and for the real rig."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal

from recordings.errors import InputError
from recordings.quantities import follows_excitation, is_motion
from recordings.run import Channel, StepState
from recordings.streams import Acquisition
from twin.procedures.broadband import run_multisine, run_random
from twin.procedures.impact import run_impact
from twin.procedures.kinds import Impact, Multisine, Procedure, Random, SweptSine
from twin.procedures.recorder import Recorder, RunSink
from twin.procedures.results import ProcedureResult, StepResult
from twin.procedures.session import Session
from twin.procedures.sine_sweeps import run_sine
from twin.procedures.stream import GuardTrip, Stream
from twin.procedures.swept_sine import run_swept_sine


def run_procedure(
    procedure: Procedure,
    acquisition: Acquisition,
    writer: RunSink,
    *,
    progress: Callable[[float], None] | None = None,
    on_step: Callable[[StepResult], None] | None = None,
) -> ProcedureResult:
    """Run a procedure and record it.

    Whatever ends it, the generator is at zero afterwards, streaming is off, and what was measured is written.

    Parameters
    ----------
    acquisition
        Virtual or real instruments, not started.
    writer
        Where blocks, steps, events and indicators go as they come; it stays open.  Its ``run`` record should say
        ``stored`` = `procedure.store`.
    progress
        Called with the seconds of rig time that have passed, often.
    on_step
        Called with every measured step.

    Returns
    -------
    ProcedureResult
        ``aborted`` if a guard tripped, samples stopped coming or the connection was lost; ``interrupted`` after
        KeyboardInterrupt, which is not raised again: what it stopped is in the result.

    Raises
    ------
    InputError
        If the procedure names channels that the rig does not have (before anything moves), or the file cannot be
        written.
    """
    check_channels(procedure, acquisition.channels)
    rate = acquisition.set_sample_rate(procedure.sample_rate)
    check_rate(procedure, rate)
    ranges = {channel.name: channel.range for channel in acquisition.channels if channel.range is not None}
    recorder = Recorder(writer, procedure.store, ranges)
    stream = Stream(acquisition, recorder, limits=procedure.limits.peak, primary=procedure.target_channel)
    session = Session(
        acquisition, stream, recorder, voltage_limit_V=procedure.limits.voltage, on_step=on_step, on_time=progress
    )
    state: Literal["done", "aborted", "interrupted"] = "done"
    reason = ""
    try:
        acquisition.start()
        stream.wait(1)  # the first block tells the devices' time
        if isinstance(procedure, Random):
            run_random(procedure, session)
        elif isinstance(procedure, Multisine):
            run_multisine(procedure, session)
        elif isinstance(procedure, SweptSine):
            run_swept_sine(procedure, session)
        elif isinstance(procedure, Impact):
            run_impact(procedure, session)
        else:
            run_sine(procedure, session, sample_rate_Hz=rate)
    except GuardTrip as trip:
        state, reason = "aborted", str(trip)
        session.note("limit", reason, source=trip.channel, time_ns=trip.time_ns)
    except KeyboardInterrupt:
        state, reason = "interrupted", "interrupted by the operator"
        session.note("interrupted", reason)
    except TimeoutError as error:
        state, reason = "aborted", str(error) or "no samples came"
        session.note("timeout", reason)
    except OSError as error:
        state, reason = "aborted", f"connection lost: {error}"
        session.note("disconnected", reason)
    finally:
        with suppress(OSError):  # a lost connection cannot be told to stop; the instrument's own watchdog must
            acquisition.stop()
    if state != "done":
        session.end(StepState.ABORTED)
        recorder.close(stream.latest_ns)
    return ProcedureResult(
        state=state,
        reason=reason,
        steps=tuple(session.steps),
        duration_s=session.elapsed_s,
        sample_rate_Hz=rate,
        events=tuple(stream.events),
        last_step=session.last_step,
    )


def check_channels(procedure: Procedure, channels: Sequence[Channel], *, source: str | Path = "procedure") -> None:
    """Refuse a procedure that asks for what a rig does not have; `source` names its file in errors.

    Raises
    ------
    InputError
        Naming the field and the rig's channels.
    """
    known = {channel.name: channel for channel in channels}
    has = f"the rig has {', '.join(known)}"
    target = known.get(procedure.target_channel)
    if target is None:
        raise InputError(source, "target_channel", f"no channel {procedure.target_channel!r}", has)
    if not follows_excitation(target.quantity):
        raise InputError(source, "target_channel", f"{target.name!r} measures {target.quantity}")
    for name in procedure.limits.peak:
        if name not in known:
            raise InputError(source, f"limits.peak.{name}", "no such channel", has)
    control = "force" if isinstance(procedure, Impact) else getattr(procedure, "control", "voltage")
    if isinstance(procedure, Impact) and procedure.sensor not in (None, *known):
        raise InputError(source, "sensor", f"no channel {procedure.sensor!r}", has)
    if (control == "force" and target.quantity != "force") or (control == "response" and target.quantity == "force"):
        raise InputError(
            source, "control", f"{control!r} does not go with target_channel {target.name!r}, a {target.quantity}"
        )
    phase = getattr(procedure, "phase", None)
    if phase is not None:
        response = known.get(phase.channel)
        if response is None or not is_motion(response.quantity):
            raise InputError(source, "phase.channel", f"{phase.channel!r} is no response channel", has)
        if not any(channel.quantity == "force" for channel in channels):
            raise InputError(source, "control", "phase resonance needs a force channel", has)


def check_rate(procedure: Procedure, rate_Hz: float, *, source: str | Path = "procedure") -> None:
    """Refuse a procedure that the converter's rate does not suit; `source` names its file in errors.

    Raises
    ------
    InputError
        If the rate is too low, or no whole number of samples makes a period of a multisine.
    """
    if rate_Hz < 0.8 * procedure.sample_rate:
        raise InputError(
            source, "sample_rate", f"the converter's nearest rate to {procedure.sample_rate:g} Hz is {rate_Hz:g} Hz"
        )
    if isinstance(procedure, Multisine) and abs((procedure.period * rate_Hz + 0.5) % 1.0 - 0.5) > 1e-6:
        raise InputError(
            source,
            "period",
            f"{procedure.period:g} s is no whole number of samples at {rate_Hz:g} Hz, which the converter has",
        )
