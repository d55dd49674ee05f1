"""Swept sines: the frequency moves without a stop."""

from collections.abc import Mapping

from recordings.quantities import is_response
from recordings.run import StepState
from twin.procedures.kinds import SweptSine
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.stretch import Passing, Size, finish
from twin.procedures.tables import ways


def run_swept_sine(procedure: SweptSine, session: Session) -> None:
    """Sweep at a fixed voltage; the frequency moves in steps of 50 ms without a phase jump.

    Each sweep is one step of frequency 0 in the recording, as all excitation that is not one sine.
    """
    duration_s = (procedure.stop - procedure.start) / procedure.rate
    for voltage_V in procedure.voltages:
        for way in ways(procedure.direction):
            place = StepPlace(
                sweep=f"{voltage_V:g}V-{way}", index=0, target_channel="voltage", target_amplitude=voltage_V
            )
            first, last = (procedure.start, procedure.stop) if way == "up" else (procedure.stop, procedure.start)
            session.stream.begin_step()
            start_ns = session.set_sine(first, voltage_V)
            # the first oscillation at a fixed frequency is a transient, not a sweep
            measure_ns = session.stream.align(start_ns + round(2e9 / first))
            session.mark(place, StepState.SETTLING, start_ns, 0.0)
            session.stream.wait(measure_ns)
            session.mark(place, StepState.MEASURING, measure_ns, 0.0)
            end_ns = measure_ns + round(duration_s * 1e9)
            session.recorder.open(measure_ns, end_ns, session.stream.buffered)
            now_ns, passing = measure_ns, Passing(session, measure_ns, duration_s)
            while now_ns < end_ns:
                share = (now_ns - measure_ns) * 1e-9 / duration_s
                holds_ns = session.set_sine(first + share * (last - first), voltage_V)
                now_ns = min(end_ns, max(now_ns, holds_ns) + round(0.05 * 1e9))
                session.stream.wait(now_ns)
                session.tick()
                passing.take(now_ns)
            sizes = passing.take()
            peak = _share_at_peak(session, sizes)
            driven = StepResult(
                **vars(place), frequency_Hz=0.0, voltage_V=session.voltage_V, amplitude=session.voltage_V, settle_s=0.0,
                peak_frequency_Hz=None if peak is None else first + peak * (last - first),
            )  # fmt: skip
            finish(session, sizes, driven)


def _share_at_peak(session: Session, sizes: Mapping[str, Size]) -> float | None:
    """At what part of the sweep the acceleration, velocity or displacement that moves most was largest."""
    moving = [one for name, one in sizes.items() if is_response(session.channels[name].quantity) and one.count]
    most = max(moving, key=lambda one: one.largest, default=None)
    return None if most is None else most.largest_at / most.samples
