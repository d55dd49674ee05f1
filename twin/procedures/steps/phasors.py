"""Phasors in the frame of the force's phase."""

import math
from collections.abc import Mapping

import numpy as np

from twin.procedures.session import Session
from twin.procedures.sine_fit import SineFit
from twin.procedures.steps.phase import resonance_phase


def relative_phasors(session: Session, fits: Mapping[str, SineFit], target: str) -> dict[str, complex]:
    """Phasors relative to the phase of the force: at rest once settled, whatever the clocks of the devices do."""
    force = session.force_channel
    name = force.name if force is not None and force.name in fits else target
    reference = fits[name].phasor if name in fits else next(iter(fits.values())).phasor
    turn = np.conj(reference) / max(abs(reference), 1e-300)
    return {channel: complex(fit.phasor * turn) for channel, fit in fits.items()}


def nearness(session: Session, turned: Mapping[str, complex], response: str) -> float | None:
    """cos2 of the phase a response is away from phase resonance: 1 there, small far away; None if it is not known."""
    force = session.force_channel
    if force is None or force.name not in turned or response not in turned or response == force.name:
        return None
    off = float(np.angle(turned[response])) - resonance_phase(session.channels[response], force)
    return math.cos(off) ** 2
