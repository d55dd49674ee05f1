"""What one step of a sine procedure asks for."""

import math
from dataclasses import dataclass

from twin.procedures.session import StepPlace
from twin.procedures.steps.amplitude import AmplitudeControl
from twin.procedures.steps.phase import PhaseLock
from twin.procedures.tables import Settle


@dataclass(frozen=True, kw_only=True)
class SineStep:
    """One step.

    `measured_channel` is the one held at the target, empty in open loop; `tolerance` what counts as held; `phase` is
    None where the frequency stays, otherwise it follows `phase_channel` until within `phase_tolerance_rad`.
    """

    place: StepPlace
    frequency_Hz: float
    voltage_V: float
    measured_channel: str
    control: AmplitudeControl
    tolerance: float
    settle: Settle
    measure_s: float
    phase: PhaseLock | None = None
    phase_channel: str = ""
    phase_tolerance_rad: float = math.inf
