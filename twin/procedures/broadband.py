"""Random noise with a held rms, and swept sines: excitation that is measured in one piece."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from recordings.run import StepState
from recordings.streams import Excitation
from twin.procedures.kinds import Random, SweptSine
from twin.procedures.results import StepResult
from twin.procedures.session import MEASURED, Place, Session
from twin.procedures.stream import Series

__all__ = ["run_random", "run_swept_sine"]

TRIAL_S = 2.0
MOST_TRIALS = 12
CHIRP_STEP_S = 0.05


def run_random(procedure: Random, session: Session) -> None:
    """Find the voltage that gives the wanted rms, settle, and measure once."""
    open_loop = procedure.control == "voltage"
    channel = "voltage" if open_loop else procedure.target_channel
    place = Place(sweep="random", index=0, target_channel=channel, target_amplitude=procedure.rms)
    voltage_V = procedure.rms if open_loop else procedure.controller.start_voltage
    voltage_V = min(voltage_V, procedure.limits.voltage)
    start_ns = _drive(procedure, session, voltage_V)
    first_ns = start_ns
    session.mark(place, StepState.SETTLING, start_ns, 0.0)
    if not open_loop:
        for _ in range(MOST_TRIALS):
            series = session.window(start_ns, TRIAL_S)
            found = _rms(series[channel]) if channel in series else math.nan
            factor = procedure.rms / max(found, 1e-12) if math.isfinite(found) else 1.0
            if abs(factor - 1.0) <= 0.5 * procedure.controller.tolerance:
                break
            wanted = voltage_V * min(factor, 5.0)
            if wanted > procedure.limits.voltage and voltage_V >= procedure.limits.voltage:
                break
            voltage_V = min(wanted, procedure.limits.voltage)
            start_ns = _drive(procedure, session, voltage_V)
    assert procedure.settle.seconds is not None
    start_ns = session.stream.align(max(start_ns, session.stream.latest_ns) + round(procedure.settle.seconds * 1e9))
    session.stream.wait(start_ns)
    series = _measure(session, place, start_ns, procedure.duration)
    amplitude = voltage_V if open_loop else _rms(series[channel]) if channel in series else math.nan
    if abs(amplitude / procedure.rms - 1.0) > procedure.controller.tolerance:
        session.note("not-held", f"rms {amplitude:.4g} instead of {procedure.rms:.4g}", source=channel)
    _finish(session, place, series, voltage_V=voltage_V, amplitude=amplitude, settle_s=(start_ns - first_ns) * 1e-9)


def run_swept_sine(procedure: SweptSine, session: Session) -> None:
    """Sweep at a fixed voltage; the frequency moves in steps of 50 ms without a phase jump.

    Each sweep is one step of frequency 0 in the recording, as all excitation that is not one sine.
    """
    ways = {"up": ["up"], "down": ["down"], "both": ["up", "down"]}[procedure.direction]
    duration_s = (procedure.stop - procedure.start) / procedure.rate
    for voltage_V in procedure.voltages:
        for way in ways:
            place = Place(sweep=f"{voltage_V:g}V-{way}", index=0, target_channel="voltage", target_amplitude=voltage_V)
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
            now_ns = measure_ns
            while now_ns < end_ns:
                share = (now_ns - measure_ns) * 1e-9 / duration_s
                holds_ns = session.set_sine(first + share * (last - first), voltage_V)
                now_ns = min(end_ns, max(now_ns, holds_ns) + round(CHIRP_STEP_S * 1e9))
                session.stream.wait(now_ns)
            series = session.window(measure_ns, duration_s)
            _finish(session, place, series, voltage_V=session.voltage_V, amplitude=session.voltage_V, settle_s=0.0)


def _drive(procedure: Random, session: Session, voltage_V: float) -> int:
    excitation = Excitation(kind="random", amplitude_V=voltage_V, band_Hz=procedure.band, seed=procedure.seed)
    session.voltage_V = voltage_V
    return session.set_output(excitation)


def _measure(session: Session, place: Place, start_ns: int, duration_s: float) -> dict[str, Series]:
    end_ns = start_ns + round(duration_s * 1e9)
    session.stream.begin_step()
    session.stream.drop_before(start_ns)
    session.mark(place, StepState.MEASURING, start_ns, 0.0)
    session.recorder.open(start_ns, end_ns, session.stream.buffered)
    done_s = 0.0
    while done_s < duration_s:
        done_s = min(duration_s, done_s + 1.0)
        session.stream.wait(start_ns + round(done_s * 1e9))
        session.tick()
    return session.window(start_ns, duration_s)


def _finish(
    session: Session, place: Place, series: Mapping[str, Series], *, voltage_V: float, amplitude: float, settle_s: float
) -> None:
    duration_s = max((len(one.samples) / one.sample_rate_Hz for one in series.values()), default=0.0)
    peak = {name: float(np.nanmax(np.abs(one.samples), initial=0.0)) for name, one in series.items()}
    end_ns = session.stream.latest_ns
    session.finish_step(
        StepResult(
            sweep=place.sweep, index=place.index, frequency_Hz=0.0, target_channel=place.target_channel,
            target_amplitude=place.target_amplitude, voltage_V=voltage_V, amplitude=amplitude, settle_s=settle_s,
            measure_s=duration_s, peak={n: p for n, p in peak.items() if session.channels[n].quantity in MEASURED},
        ),
        end_ns,
    )  # fmt: skip
    session.recorder.close()
    session.mark(place, StepState.DONE, end_ns, 0.0)


def _rms(series: Series) -> float:
    known = series.samples[np.isfinite(series.samples)]
    return float(np.std(known)) if len(known) else math.nan
