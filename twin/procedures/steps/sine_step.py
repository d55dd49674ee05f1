"""One step of a sine procedure: set, hold the amplitude while it settles, measure."""

from recordings.run import StepState
from twin.procedures.results import StepResult
from twin.procedures.session import Session
from twin.procedures.steps.measured import measured
from twin.procedures.steps.step import SineStep
from twin.procedures.steps.wait import Wait


def run_sine_step(session: Session, step: SineStep, *, sample_rate_Hz: float) -> StepResult:
    """Run one step; the generator is left as it was while measuring."""
    session.stream.begin_step()
    holds_ns = session.set_sine(step.frequency_Hz, step.voltage_V)
    session.mark(step.place, StepState.SETTLING, holds_ns, step.frequency_Hz)
    wait = Wait(session, step, holds_ns, sample_rate_Hz)
    measure_ns = session.stream.align(wait.run())
    frequency_Hz = session.frequency_Hz
    count = max(1, round(step.measure_s * sample_rate_Hz))
    end_ns = measure_ns + round(count / sample_rate_Hz * 1e9)
    session.stream.drop_before(measure_ns)
    session.mark(step.place, StepState.MEASURING, measure_ns, frequency_Hz)
    session.recorder.open(measure_ns, end_ns, session.stream.buffered)
    series = session.window(measure_ns, count / sample_rate_Hz)
    result = measured(
        session, step, series, wait=wait, settle_s=(measure_ns - holds_ns) * 1e-9, measure_s=count / sample_rate_Hz
    )
    if abs(result.amplitude_error) > step.tolerance:
        told = f"{result.amplitude:.4g} instead of {result.target_amplitude:.4g} at {result.frequency_Hz:g} Hz"
        told += f"; the generator is at its limit of {session.voltage_V:g} V" if session.saturated else ""
        session.note("not-held", told, source=result.target_channel)
    session.finish_step(result, end_ns)
    return result
