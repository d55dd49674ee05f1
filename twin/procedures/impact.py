"""Hits of a hammer: the generator is off, and each record begins a little before the force passes the trigger."""

import numpy as np

from recordings.run import StepState
from recordings.streams import Excitation
from twin.procedures.kinds import Impact
from twin.procedures.limits import LIMITS
from twin.procedures.results import StepResult
from twin.procedures.session import Session, StepPlace
from twin.procedures.stretch import finish, measure


def run_impact(procedure: Impact, session: Session) -> None:
    """Record the hits at one point after the other: a sweep is a point, a step of it a hit."""
    pre_ns = round(procedure.pre_trigger * 1e9)
    force = procedure.target_channel
    ready_ns = session.set_output(Excitation())
    for name in procedure.places:
        for index in range(procedure.hits):
            place = StepPlace(sweep=name, index=index, target_channel=force, target_amplitude=procedure.hammer.peak)
            session.mark(place, StepState.SETTLING, ready_ns, 0.0)
            hit_ns = _wait_for_hit(procedure, session, place, ready_ns + pre_ns)
            start_ns = session.stream.align(hit_ns - pre_ns)
            sizes = measure(session, place, start_ns, procedure.record)
            settle_s = max(0.0, (start_ns - ready_ns) * 1e-9)
            hit = StepResult(
                **vars(place), frequency_Hz=0.0, voltage_V=0.0, amplitude=sizes[force].largest, settle_s=settle_s
            )
            finish(session, sizes, hit)
            ready_ns = start_ns + round(procedure.record * 1e9)


def _wait_for_hit(procedure: Impact, session: Session, place: StepPlace, from_ns: int) -> int:
    """Time at which the force passes the trigger, looked for from a time on."""
    look_ns, longest_ns = from_ns, round(procedure.patience * 1e9)
    while look_ns - from_ns < longest_ns:
        force = session.stream.window(look_ns, LIMITS.looked_for_s)[procedure.target_channel]
        beyond = np.flatnonzero(np.abs(force.samples) > procedure.trigger)
        if len(beyond):
            return look_ns + round((force.offset_s + int(beyond[0]) / force.sample_rate_Hz) * 1e9)
        session.stream.drop_before(look_ns - round(procedure.pre_trigger * 1e9))
        look_ns += round(LIMITS.looked_for_s * 1e9)
        session.tick()
    raise TimeoutError(f"no hit at {place.sweep} beyond {procedure.trigger:g} N within {procedure.patience:g} s")
