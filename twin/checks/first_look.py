"""All checks in their order: each may rely on what those before it have let pass."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from recordings.errors import InputError
from recordings.run import Run
from recordings.whereabouts import working_on
from twin.checks.agreement import RunBesideModel, agreement_of
from twin.checks.belonging import look_at_aliasing, look_at_belonging
from twin.checks.clock import look_at_clock
from twin.checks.expected import ExpectedResponse
from twin.checks.finding import Finding
from twin.checks.held import amplitudes_over_target, look_at_target
from twin.checks.order import look_at_directions, look_at_order
from twin.checks.preload import look_at_preload
from twin.checks.quantities import look_at_quantities
from twin.checks.said import look_at_days, look_at_metadata
from twin.checks.same_run import look_at_copies, without_repeats
from twin.checks.samples import look_at_samples
from twin.checks.scale import look_at_commanded, look_at_scale
from twin.checks.specimen import look_at_specimens
from twin.checks.thresholds import SHAPE
from twin.diagnose.signals import as_known
from twin.identify.measured_data import common_preload, response_outputs
from twin.identify.rig_channels import drive_of, in_directions_of, own_channels, without_channels
from twin.rigs import Rig, preload_names

Seen = TypeVar("Seen")


@dataclass(frozen=True)
class FirstLook:
    """What was seen, and the runs without what is set aside."""

    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]
    """To go on with."""
    findings: tuple[Finding, ...]
    """Those that stop first."""

    @property
    def stopped(self) -> bool:
        """Whether no fit should be begun."""
        return _stops(self.findings)

    @property
    def told(self) -> tuple[str, ...]:
        """A line for each finding."""
        return tuple(finding.line for finding in self.findings)

    def passed(self) -> "FirstLook":
        """Itself, where nothing stops; InputError for the first finding that stops."""
        if self.stopped:
            raise self.findings[0].refusal()
        return self


def first_look(runs: Sequence[Run], rig: Rig, *, held_out: Sequence[Run] = (), preload: str | None = None) -> FirstLook:
    """Look at recordings beside a rig, in a second or two and without a fit.

    Parameters
    ----------
    runs, held_out
        Recordings to learn from, and those that no fit sees.
    preload
        State of the rig's joints; what the recordings name if not given.

    Raises
    ------
    InputError
        If the recordings lack the rig's force channel or share no response channel with it, or were made at different
        preloads.
    """
    force = rig.force_sensor.channel
    learnt, kept = len(runs), [*runs, *held_out]
    common = preload or common_preload(kept, rig)
    known = [as_known(own_channels(run, rig), rig) for run in kept]
    response_outputs(known, rig)
    findings = [finding for run in kept for finding in look_at_metadata(run, rig, preload=preload)]
    findings += look_at_days(kept)
    looked = [_blamed(run, lambda run: look_at_samples(run, force=force)) for run in known]
    clean = [run for run, _ in looked]
    findings += [finding for _, found in looked for finding in found]
    findings += [finding for run in clean for finding in _blamed(run, look_at_copies)]
    if not _stops(findings):
        findings += [finding for run in clean for finding in _blamed(run, lambda run: look_at_clock(run, force=force))]
    if not _stops(findings):
        first, second, repeated = without_repeats(clean[:learnt], clean[learnt:], force=force)
        findings += repeated
        if not _stops(repeated):
            findings += _against_model(first, second, rig, common, findings)
            across = {finding.channel for finding in findings if finding.kind == "across"}
            first, second = ([without_channels(run, across) for run in runs] for runs in (first, second))
            return FirstLook(tuple(first), tuple(second), _in_order(findings))
    return FirstLook(tuple(clean[:learnt]), tuple(clean[learnt:]), _in_order(findings))


def _blamed(run: Run, look: Callable[[Run], Seen]) -> Seen:
    """What a check sees of a run, which an error in it is then about."""
    with working_on(run.path):
        return look(run)


def _stops(findings: Sequence[Finding]) -> bool:
    return any(finding.action == "stopped" for finding in findings)


def _in_order(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Those that stop first, then what was set aside, then the rest."""
    order = ("stopped", "set aside", "told")
    return tuple(sorted(findings, key=lambda finding: order.index(finding.action)))


def _against_model(
    learnt: Sequence[Run], held_out: Sequence[Run], rig: Rig, preload: str, before: Sequence[Finding]
) -> list[Finding]:
    """What the rig's linear model has to say, and what goes with it."""
    runs = [*learnt, *held_out]
    try:
        outputs = response_outputs(runs, rig)
    except InputError:
        dead = next((finding for finding in before if finding.action == "set aside" and finding.channel), None)
        if dead is None:
            raise
        return [replace(dead, action="stopped")]
    force = rig.force_sensor.channel
    runs = [in_directions_of(run, runs[0], rig) for run in runs]
    channels = tuple(output.channel for output in outputs)
    by_drive = {drive: ExpectedResponse.of(rig.driven_by(drive), outputs, preload) for drive in rig.drives}
    drives = [drive_of(run, rig) for run in runs]
    known = {str(effect.parameters.get("channel", "")) for effect in rig.effect}
    findings: list[Finding] = []
    responses, agreeing = [], []
    for run, drive in zip(runs, drives, strict=True):
        with working_on(run.path):
            seen = RunBesideModel.of(run, by_drive[drive], force=force, channels=channels)
            responses.append(seen)
            over_target = amplitudes_over_target(run, (force, *channels))
            own = look_at_belonging(seen) or look_at_target(run, over_target, force=force)
            if not _stops(own):
                own += look_at_order(seen)
            own += look_at_aliasing(seen)
            findings += own
            if _stops(own):
                continue
            agreement = agreement_of(seen.noise, seen.sines, seen.expected)
            commanded = _commanded(run, over_target, force)
            if agreement is None:
                findings += look_at_commanded(run.path, commanded, force=force)
                continue
            agreeing.append((run, agreement))
            findings += look_at_quantities(seen, agreement) or look_at_scale(
                run.path, agreement, channels, force=force, commanded=commanded, known=known
            )
            if np.min(agreement.shape) > SHAPE and any(one.kind == "rig" and one.run == run.path for one in before):
                said = next(one for one in before if one.kind == "rig" and one.run == run.path)
                findings.append(
                    replace(said, found=f"{said.found}, and the responses have another shape", action="stopped")
                )
    if not known.intersection(channels):
        findings += look_at_directions(agreeing, force=force, channels=channels)
    if not _stops(findings):
        for drive, expected in by_drive.items():
            of_drive = [n for n, one in enumerate(drives) if one == drive]
            first = [responses[n] for n in of_drive if n < len(learnt)]
            second = [responses[n] for n in of_drive if n >= len(learnt)]
            driven = rig.driven_by(drive)
            names = [name for name in preload_names(rig) if name != preload]
            others = {name: ExpectedResponse.of(driven, outputs, name) for name in names}
            noises = [one for seen in [*first, *second] for one in seen.noise]
            findings += look_at_preload(noises, {preload: expected, **others}, preload)
            findings += look_at_specimens(first, second, expected)
    return findings


def _commanded(run: Run, over_target: dict[str, tuple[float, float]], force: str) -> float:
    """Force over what the steps command; nan where they command something else, or it was not held."""
    level, spread = over_target[force]
    named = {step.target_channel for step in run.steps} - {""}
    return math.exp(level) if named == {force} and spread < SHAPE else math.nan
