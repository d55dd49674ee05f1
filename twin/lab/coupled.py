"""A rig of substructures, coupled: predicted responses, and its joints identified from measured ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from recordings.errors import InputError
from recordings.responses import are_responses, read_responses
from twin.lab.shown import Shown
from twin.rigs.preloads import known_preload
from twin.rigs.store import load_substructures
from twin.substructuring import (
    CoupledPrediction,
    JointFit,
    JointValues,
    Substructures,
    gather_substructures,
    identify_joints,
    predict,
)
from twin.substructuring.limits import LIMITS
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.style import AFTER, BEFORE, MEASURED
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class CoupledResponses(Shown):
    """Responses of a coupled rig."""

    parts: Substructures
    """What was coupled."""
    predicted: CoupledPrediction
    """Responses of the rig's sensors over the forces of its drives, with the identified joints if there are any."""
    fit: JointFit | None
    """The joints, if a measured response was given."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What an engineer should know of the parts and of the fit."""
        poor = (
            f"{part.name}: its synthesis leaves {part.synthesis.chi2_per_dof:.3g} times the noise's chi2: a response "
            "that is not linear, reciprocal or viscously damped, or points that moved"
            for part in self.parts.parts if part.synthesis.chi2_per_dof > LIMITS.poor
        )  # fmt: skip
        return (*poor, *(() if self.fit is None else self.fit.notes))

    @property
    def sentence(self) -> str:
        """What was coupled, and how well it predicts what was measured."""
        f = self.predicted.frequency_Hz
        names = ", ".join(part.name for part in self.parts.parts)
        told = f"{names} by responses, coupled from {f[0]:g} to {f[-1]:g} Hz"
        if self.fit is not None:
            before, after = self.fit.errors
            told += f"; median error {before:.2%} with the file's joints, {after:.2%} with the identified ones"
        return f"{told}."

    def tables(self) -> Sequence[Table]:
        """Measured parts, and joints if they were identified."""
        head: tuple[str, ...] = ("part", "points", "modes", "below all lines", "chi2 per dof")
        rows: list[tuple[str, ...]] = [
            (part.name, str(s.points), str(s.modes), str(s.rigid), f"{s.chi2_per_dof:.3f}")
            for part in self.parts.parts
            for s in [part.synthesis]
        ]
        parts = Table(caption="Parts known by their responses", head=head, rows=rows, numbers=range(1, 5))
        if self.fit is None:
            return [parts]
        file, found = JointValues.of(self.parts), self.fit.values
        rows = [
            (*gap, _unit(gap[1]), f"{file.stiffness[gap]:.5g}", f"{k:.5g}", f"{found.stiffness_std[gap]:.2g}")
            for gap, k in found.stiffness.items()
        ]
        rows += [
            (name, "loss factor", "", f"{file.loss_factor[name]:.4g}", f"{loss:.4g}", f"{found.loss_std[name]:.2g}")
            for name, loss in found.loss_factor.items()
        ]
        head = ("connection", "motion", "unit", "file", "identified", "std")
        return [parts, Table(caption="Joints", head=head, rows=rows, numbers=(3, 4, 5))]

    def plot(self) -> Figure:
        """Magnitudes of each sensor's response over the first drive's force, predicted with one standard deviation."""
        predicted, fit = self.predicted, self.fit
        sensors = [sensor.channel for sensor in self.parts.rig.response_sensors]
        figure, axes = panels(len(sensors), 1, height_in=0.5 + 2.2 * len(sensors), sharex=True)
        for number, (name, each) in enumerate(zip(sensors, axes[:, 0], strict=True)):
            if fit is not None:
                f = fit.before.frequency_Hz
                each.plot(f, np.abs(fit.measured[:, number, 0]), ".", color=MEASURED, markersize=2.5, label="measured")
                each.plot(
                    f, np.abs(fit.before.H[:, number, 0]), color=BEFORE, linewidth=0.8, label="joints of the file"
                )
            label = "predicted" if fit is None else "joints identified"
            magnitude, std = np.abs(predicted.H[:, number, 0]), predicted.std[:, number, 0]
            draw_band(each, predicted.frequency_Hz, magnitude, std, colour=AFTER, linewidth=0.9, label=label)
            each.set_yscale("log")
            dressed(each, ylabel=f"|{name} / force|, SI units")
        axes[-1, 0].set_xlabel("frequency, Hz")
        legend(figure)
        return figure

    def to_dict(self) -> dict[str, Any]:
        """As the command prints it with ``--json``."""
        table: dict[str, Any] = {
            "rig": self.parts.rig.name, "lines": len(self.predicted.frequency_Hz), "notes": list(self.notes),
            "parts": [
                {"part": p.name, "points": s.points, "modes": s.modes, "rigid": s.rigid, "chi2_per_dof": s.chi2_per_dof}
                for p in self.parts.parts for s in [p.synthesis]
            ],
        }  # fmt: skip
        if self.fit is not None:
            found = self.fit.values
            table["joints"] = [
                {"connection": name, "motion": dof, "unit": _unit(dof),
                 "stiffness": {"value": k, "std": found.stiffness_std[name, dof]}}
                for (name, dof), k in found.stiffness.items()
            ]  # fmt: skip
            table["loss_factors"] = {
                name: {"value": loss, "std": found.loss_std[name]} for name, loss in found.loss_factor.items()
            }
            table["median_error"] = dict(zip(("before", "after"), self.fit.errors, strict=True))
            table["chi2_per_dof"] = self.fit.chi2_per_dof
        return table


def couple(rig: str | Path, *, measured: str | Path | None = None, preload: str | None = None) -> CoupledResponses:
    """Couple a rig file of substructures, and identify its joints.

    Parameters
    ----------
    rig
        A rig file with ``kind = "substructures"``.
    measured
        Responses of the whole, from which the joints are identified.
    preload
        State of the modelled parts' own joints; the first if not given.

    Raises
    ------
    InputError
        If a file cannot be read or does not fit.
    """
    loaded = load_substructures(rig)
    if measured is not None and not (Path(measured).is_file() and are_responses(Path(measured))):
        raise InputError(measured, "", "is no file of frequency responses", "give .uff, .unv, .npz or .csv")
    parts = gather_substructures(loaded, preload=known_preload(loaded, preload) if loaded.joints else None)
    fit = None if measured is None else identify_joints(parts, read_responses(measured))
    return CoupledResponses(parts=parts, predicted=predict(parts, fit), fit=fit)


def _unit(dof: str) -> str:
    return "N m/rad" if dof.startswith("r") else "N/m"
