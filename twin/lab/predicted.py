"""Predicted responses, all branches."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from recordings import InputError
from twin.diagnose.effects import left_out_effects, with_effects
from twin.identify.backbones.drive_table import DriveTable
from twin.identify.backbones.modal_prediction import ModalResponse, predict_forced, predict_held
from twin.identify.forward.predict import RigPrediction, RigResponse, blank_data
from twin.lab.shown import Shown
from twin.rigs import LawTable
from twin.rigs.assumed import assumed
from twin.rigs.beam import BeamRig
from twin.rigs.modal import ModalRig
from twin.rigs.preloads import known_preload
from twin.rigs.store import AnyRig, no_structure
from twin.structure.plausibility import unlikely_units
from twin.views.drawing import dressed, panels
from twin.views.style import AFTER, BEFORE
from twin.views.table import Table

MOST_ROWS = 40


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class PredictedResponse(Shown):
    """One row a solution; a step with three solutions has three."""

    response: ModalResponse
    """Its columns as arrays."""
    given: str
    """``force`` or ``acceleration``."""
    assumed: tuple[str, ...] = ()
    """What stands for what the rig file leaves out."""
    warnings: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """How many solutions there are."""
        told = f"{len(self.response.step)} solutions, at most {self.response.branches} at a step"
        return "; ".join([told, *self.warnings]) + "." + "".join(f"  Assumed: {line}." for line in self.assumed)

    def tables(self) -> Sequence[Table]:
        """The first rows."""
        r = self.response
        count = len(r.step)
        caption = "Solutions" + (f", the first {MOST_ROWS} of {count}" if count > MOST_ROWS else "")
        rows = [
            (
                f"{r.frequency_Hz[i]:.6g}", f"{r.force_N[i]:.4g}", f"{r.acceleration_m_per_s2[i]:.4g}",
                f"{r.std[i]:.2g}", f"{r.phase_rad[i]:.3f}", str(r.branch[i]), "yes" if r.stable[i] else "no",
            )
            for i in range(min(MOST_ROWS, count))
        ]  # fmt: skip
        head = ("frequency, Hz", "force, N", "acceleration, m/s²", "std", "phase, rad", "branch", "stable")
        return [Table(caption=caption, head=head, rows=rows, numbers=range(6))]

    def plot(self) -> Figure:
        """What was not given against frequency; stable solutions apart from those where no sweep can rest."""
        r = self.response
        by_force = self.given == "force"
        value, label = (r.acceleration_m_per_s2, "acceleration, m/s²") if by_force else (r.force_N, "force, N")
        figure, ((axes,),) = panels(1, 1, height_in=3.4)
        for stable, colour, name in ((True, AFTER, "stable"), (False, BEFORE, "unstable")):
            pick = r.stable == stable
            if pick.any():
                axes.errorbar(
                    r.frequency_Hz[pick], value[pick], yerr=r.std[pick], fmt="o", markersize=3.2, linewidth=0.8,
                    color=colour, label=name,
                )  # fmt: skip
        axes.set_ylim(bottom=0)
        dressed(axes, xlabel="frequency, Hz", ylabel=label, title="predicted, ± one standard deviation")
        axes.legend(frameon=False, fontsize=9)
        return figure


def asked_drive(
    frequency_Hz: Iterable[float],
    force_N: float | Iterable[float] | None,
    acceleration_m_per_s2: float | Iterable[float] | None,
) -> DriveTable:
    """What is asked for as :meth:`twin.lab.rig.LabRig.predict` takes it.

    Raises
    ------
    ValueError
        If not just one of force and acceleration is given, or numbers are missing or not above zero.
    """
    if (force_N is None) == (acceleration_m_per_s2 is None):
        raise ValueError("give either force_N or acceleration_m_per_s2")
    target = acceleration_m_per_s2 if force_N is None else force_N
    frequency = np.array(list(frequency_Hz), float)
    given = np.array(list(target) if isinstance(target, Iterable) else [target], float)
    level = np.broadcast_to(given, frequency.shape) if len(given) == 1 else given
    if level.shape != frequency.shape:
        raise ValueError(f"{len(frequency)} frequencies, but {len(level)} values")
    if not (np.all(np.isfinite(frequency) & (frequency > 0)) and np.all(np.isfinite(level) & (level > 0))):
        raise ValueError("frequencies, forces and accelerations are finite and above zero")
    return DriveTable(frequency, None if force_N is None else level, level if force_N is None else None)


def predict_response(
    rig: AnyRig, drive: DriveTable, *, preload: str | None, shaker: str | None, channel: str | None, source: str
) -> PredictedResponse:
    """Predict the steady responses of a rig; `source` names it in errors."""
    held, frequency = drive.force_N is None, drive.frequency_Hz
    level = drive.acceleration_m_per_s2 if drive.force_N is None else drive.force_N
    assert level is not None
    name = "acceleration" if held else "force"
    if isinstance(rig, ModalRig):
        for what, chosen in (("preload", preload), ("shaker", shaker), ("channel", channel)):
            if chosen is not None:
                raise InputError(source, f"--{what}", f"a modal model has one mode and no choice of a {what}")
        if rig.law is None:
            raise InputError(source, "law", "this modal rig has none yet", "identify it from sweeps first")
        predict = predict_held if held else predict_forced
        return PredictedResponse(response=predict(rig.law, frequency, level), given=name, warnings=())
    if isinstance(rig, BeamRig):
        raise no_structure(rig.kind, source)
    rig = rig.driven_by(shaker)
    evidence = blank_data(rig, known_preload(rig, preload))
    known = f"the rig has {', '.join(evidence.channels)}"
    if channel not in (None, *evidence.channels):
        raise InputError(source, "--channel", f"no response sensor is called {channel!r}", known)
    for law in (joint.law for joint in rig.joints):
        if isinstance(law, LawTable) and law.channel not in evidence.channels:
            raise InputError(source, "joint.law.channel", f"no response sensor is called {law.channel!r}", known)
    warnings = left_out_effects(rig.effect)
    warnings += [f"implausible: {line}" for line in unlikely_units(rig)]
    evidence = with_effects(evidence, source=source)
    try:
        model = RigResponse(evidence, channel=channel)
    except ValueError as error:
        raise InputError(source, "joint.law", str(error).removeprefix("joint.law: ")) from error
    found = model.held(frequency, level) if held else model.forced(frequency, level)
    warnings += _told(found)
    return PredictedResponse(response=found, given=name, assumed=assumed(rig, bench=False), warnings=tuple(warnings))


def _told(found: RigPrediction) -> list[str]:
    """A sentence on solutions that the law does not reach, and one on those that were not found."""
    rows, told = len(found.step), []
    if unseen := int(np.sum(found.unseen)):
        told.append(
            f"{unseen} of {rows} solutions move the joint farther than its law was identified, up to "
            f"{found.beyond.max():.2g} times; their std is wide"
        )
    if unsettled := int(np.sum(found.unsettled)):
        told.append(f"{unsettled} of {rows} solutions did not settle and are not to be trusted")
    return told
