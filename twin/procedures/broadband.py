"""Random noise and multisines: broadband excitation with a held rms."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from recordings.quantities import follows_excitation
from recordings.run import StepState
from recordings.streams import Excitation
from twin.procedures.kinds import Multisine, Random
from twin.procedures.limits import LIMITS
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.stream import Series
from twin.procedures.stretch import finish, measure, rms

MOST_TRIALS = 12


def run_random(procedure: Random, session: Session) -> None:
    """Find the voltage that gives the wanted rms, settle, and measure once."""
    held = _hold(procedure, session, trial_s=LIMITS.trial_s)
    assert procedure.settle.seconds is not None
    wait_ns = round(procedure.settle.seconds * 1e9)
    start_ns = session.stream.align(max(held.since_ns, session.stream.latest_ns) + wait_ns)
    session.stream.wait(start_ns)
    _measure(procedure, session, held, start_ns, procedure.duration)


def run_multisine(procedure: Multisine, session: Session) -> None:
    """Find the voltage that gives the wanted rms, wait until the periods repeat, and measure whole periods."""
    held = _hold(procedure, session, trial_s=math.ceil(LIMITS.trial_s / procedure.period - 1e-9) * procedure.period)
    settle = procedure.settle
    start_ns = held.since_ns
    longest_s = settle.maximum if settle.seconds is None else settle.seconds
    periods: list[dict[str, Series]] = []
    settled: bool | None = None if settle.seconds is not None else False
    left: float | None = None
    changes: list[dict[str, float]] = []
    while (start_ns - held.since_ns) * 1e-9 + procedure.period <= longest_s + 1e-9:
        periods = [*periods[-1:], session.window(start_ns, procedure.period)]
        start_ns += round(procedure.period * 1e9)
        changes += [_changes(session, before, after) for before, after in pairwise(periods)]
        left = _left(changes, apart=math.ceil(LIMITS.trial_s / procedure.period - 1e-9))
        waited_s = (start_ns - held.since_ns) * 1e-9
        if settle.seconds is None and left is not None and left <= settle.tolerance and waited_s >= settle.minimum:
            settled = True
            break
    if settle.seconds is not None:
        start_ns = max(start_ns, held.since_ns + round(settle.seconds * 1e9))
    start_ns = session.stream.align(start_ns)
    session.stream.wait(start_ns)
    duration_s = procedure.periods * procedure.period
    _measure(procedure, session, held, start_ns, duration_s, settled=settled, remaining=left)


@dataclass(frozen=True)
class _Held:
    """Broadband excitation since `since_ns`; the first since `first_ns`."""

    place: StepPlace
    voltage_V: float
    first_ns: int
    since_ns: int


def _hold(procedure: Random | Multisine, session: Session, *, trial_s: float) -> _Held:
    """Switch on, and find the voltage that gives the wanted rms."""
    open_loop = procedure.control == "voltage"
    channel = "voltage" if open_loop else procedure.target_channel
    place = StepPlace(sweep=procedure.procedure, index=0, target_channel=channel, target_amplitude=procedure.rms)
    voltage_V = procedure.rms if open_loop else procedure.controller.start_voltage
    voltage_V = min(voltage_V, procedure.limits.voltage)
    first_ns = since_ns = _drive(procedure, session, voltage_V)
    session.mark(place, StepState.SETTLING, first_ns, 0.0)
    for _ in range(0 if open_loop else MOST_TRIALS):
        series = session.window(since_ns, trial_s)
        found = rms(series[channel]) if channel in series else math.nan
        factor = procedure.rms / max(found, 1e-12) if math.isfinite(found) else 1.0
        if abs(factor - 1.0) <= 0.5 * procedure.controller.tolerance:
            break
        wanted = voltage_V * min(factor, 5.0)
        if wanted > procedure.limits.voltage and voltage_V >= procedure.limits.voltage:
            break
        voltage_V = min(wanted, procedure.limits.voltage)
        since_ns = _drive(procedure, session, voltage_V)
    return _Held(place, voltage_V, first_ns, since_ns)


def _drive(procedure: Random | Multisine, session: Session, voltage_V: float) -> int:
    session.voltage_V = voltage_V
    return session.set_output(
        Excitation(
            kind=procedure.procedure,
            amplitude_V=voltage_V,
            band_Hz=procedure.band,
            seed=procedure.seed,
            period_s=procedure.period if isinstance(procedure, Multisine) else 1.0,
        )
    )


def _measure(
    procedure: Random | Multisine,
    session: Session,
    held: _Held,
    start_ns: int,
    duration_s: float,
    *,
    settled: bool | None = None,
    remaining: float | None = None,
) -> None:
    place = held.place
    sizes = measure(session, place, start_ns, duration_s)
    amplitude = held.voltage_V
    if procedure.control != "voltage":
        amplitude = sizes[place.target_channel].std if place.target_channel in sizes else math.nan
    if abs(amplitude / procedure.rms - 1.0) > procedure.controller.tolerance:
        session.note("not-held", f"rms {amplitude:.4g} instead of {procedure.rms:.4g}", source=place.target_channel)
    driven = StepResult(
        **vars(place), frequency_Hz=0.0, voltage_V=held.voltage_V, amplitude=amplitude,
        settle_s=(start_ns - held.first_ns) * 1e-9, settled=settled, remaining=remaining,
    )  # fmt: skip
    finish(session, sizes, driven)


def _changes(session: Session, before: dict[str, Series], after: dict[str, Series]) -> dict[str, float]:
    """From one period to the next, relative to the signal, of each channel that follows the excitation."""
    found = {}
    for name, one in after.items():
        if follows_excitation(session.channels[name].quantity) and name in before:
            difference = one.samples - before[name].samples
            known = difference[np.isfinite(difference)]
            size = rms(one)
            if len(known) and size > 0:
                found[name] = float(np.sqrt(np.mean(known**2))) / size
    return found


def _left(changes: list[dict[str, float]], *, apart: int) -> float | None:
    """What of a transient is left in the worst channel, extrapolated from how its change between periods falls.

    How it falls is seen between periods so far `apart` that a slow decay stands out of the scatter; None before.  A
    change that falls no more is the noise of two periods: nothing is left of the transient that could be told from it.
    """
    if len(changes) <= apart:
        return None
    worst = 0.0
    for name, now in changes[-1].items():
        before = changes[-1 - apart].get(name, math.inf)
        if now <= LIMITS.still_falling * before:
            ratio = (now / before) ** (1 / apart)
            worst = max(worst, now * ratio / (1.0 - ratio))
    return worst
