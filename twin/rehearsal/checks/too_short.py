"""Too short: noise that ends before the lowest mode in its band is averaged, records that end before hits decay.

Likewise a sine that is swept too fast: the resonance has no time to build up; its peak comes out low, wide and late.
"""

import math
from collections.abc import Iterator

from twin.procedures import Impact, Random, SweptSine
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def averages(duration_s: float, frequency_Hz: float, damping_ratio: float) -> float:
    """How often noise of a length has a stretch that resolves a mode's half-power width."""
    return duration_s * 2 * damping_ratio * frequency_Hz


def check_length(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge random noise and hits by the lowest mode that they excite, which is the sharpest and decays last."""
    procedure, mode = rehearsal.procedure, rehearsal.lowest_mode
    if isinstance(procedure, Impact):
        yield from _check_records(rehearsal, procedure)
    if not isinstance(procedure, Random) or mode is None or not rehearsal.result.steps:
        return
    frequency_Hz, ratio = mode
    count = averages(procedure.duration, frequency_Hz, ratio)
    if count >= LIMITS.too_short_fewest:
        return
    width_Hz = 2 * ratio * frequency_Hz
    needed_s = float(math.ceil(LIMITS.too_short_wanted / width_Hz))
    step = rehearsal.result.steps[0]
    yield Caution.at(
        step, kind="too-short", severity="warning", frequency_Hz=frequency_Hz, steps=1, size=1 / count,
        reason=f"{procedure.duration:g} s of noise make {count:.2g} averages at the resolution that the mode at "
        f"{frequency_Hz:.4g} Hz asks for, its width of {width_Hz:.2g} Hz: its damping cannot be told",
        advice=f"record {needed_s:g} s", changes={"duration": needed_s},
    )  # fmt: skip


def check_sweep_rate(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep by the resonance that it met."""
    procedure = rehearsal.procedure
    if not isinstance(procedure, SweptSine):
        return
    for step in rehearsal.result.steps:
        if step.peak_frequency_Hz is None:
            continue
        half_Hz = rehearsal.half_width_Hz(step.peak_frequency_Hz)
        fastest = LIMITS.sweep_rate_fastest * half_Hz**2
        if procedure.rate <= fastest:
            continue
        rate = float(f"{LIMITS.sweep_rate_wanted * fastest:.2g}")
        yield Caution.at(
            step, kind="sweep-too-fast", severity="warning", frequency_Hz=step.peak_frequency_Hz, steps=1,
            reason=f"{procedure.rate:g} Hz/s passes the resonance near {step.peak_frequency_Hz:.4g} Hz, which is "
            f"{2 * half_Hz:.2g} Hz wide, before it has built up: a low, wide and late peak, false damping",
            advice=f"sweep at {rate:g} Hz/s or slower, over a narrower range if that takes too long; or step",
            changes={"rate": rate},
        )  # fmt: skip


def _check_records(rehearsal: Rehearsal, procedure: Impact) -> Iterator[Caution]:
    """Whether what a hit leaves dies within its record."""
    if not rehearsal.nominal.modes or not rehearsal.result.steps:
        return
    frequency_Hz, ratio = rehearsal.nominal.modes[0]
    rate_per_s = 2 * math.pi * ratio * frequency_Hz
    left = math.exp(-rate_per_s * (procedure.record - procedure.pre_trigger))
    if left < LIMITS.left_of_a_hit:
        return
    needed_s = round(procedure.pre_trigger - math.log(LIMITS.wanted_of_a_hit) / rate_per_s, 1)
    step = rehearsal.result.steps[0]
    yield Caution.at(
        step, kind="too-short", severity="warning", frequency_Hz=frequency_Hz, steps=len(rehearsal.result.steps),
        size=left,
        reason=f"a record of {procedure.record:g} s ends when the mode at {frequency_Hz:.4g} Hz has decayed to "
        f"{left:.2g} only: it takes an exponential window that adds about as much damping as the mode has, or more",
        advice=f"record {needed_s:g} s", changes={"record": needed_s},
    )  # fmt: skip
