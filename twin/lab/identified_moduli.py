"""Moduli identified from a table of natural frequencies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.effects import with_effects
from twin.diagnose.tables import felt_causes
from twin.identify.estimate import Estimate
from twin.identify.frequency_moduli import FrequencyModuli, fit_moduli, moduli_data
from twin.lab.model_result import IdentifiedModel
from twin.rigs import Rig
from twin.rigs.beam import BeamRig
from twin.views.figures import error_bars
from twin.views.page import Page, Picture, Section
from twin.views.reports.answer import frequencies_table, sentences
from twin.views.style import AFTER, BEFORE
from twin.views.table import Table

OPEN = 1.0
"""Standard deviation of a logarithm from which on the frequencies leave a combination open."""


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedModuli(IdentifiedModel):
    """A structure's moduli, identified from the table of natural frequencies in the file `table`."""

    found: FrequencyModuli
    table: str
    nominal: Rig | BeamRig

    @property
    def file(self) -> Rig | BeamRig:
        """The rig file with what was identified."""
        model = self.found.model
        return self.nominal.found(model) if isinstance(self.nominal, BeamRig) else model

    @property
    def sentence(self) -> str:
        """The moduli, and how well they meet the frequencies."""
        moduli = " and ".join(f"{symbol} = {identified} N/mm²" for symbol, _, identified in self._moduli().rows)
        worst = float(np.max(np.abs(self.found.error_percent)))
        return f"{moduli} meet the {len(self.found.mode)} natural frequencies within {worst:.2g} %."

    def tables(self) -> Sequence[Table]:
        """Moduli, and measured and modelled frequencies."""
        found = self.found
        return [
            self._moduli(),
            frequencies_table(found.mode, found.measured_Hz, found.before_Hz, found.after_Hz, after="identified"),
        ]

    def _moduli(self) -> Table:
        found = self.found
        rows = [
            (
                self._symbol(name), f"{1e-6 * was:.4g}",
                str(Estimate(1e-6 * found.moduli[name], 1e-6 * found.moduli_std[name])),
            )
            for name, was in found.nominal.items()
        ]  # fmt: skip
        head, caption = ("modulus", "nominal", "identified"), "Moduli in N/mm², with one standard deviation"
        return Table(caption=caption, head=head, rows=rows, numbers=(1, 2))

    def _symbol(self, name: str) -> str:
        """Of a modulus, with the joint or the beams whose it is where there are several."""
        kind, _, of = name.removesuffix("]").partition("[")
        if len(self.found.model.joints) == 1:
            of = ""
        elif self.found.model.joints:
            of = of.removesuffix(f", {self.found.preload}")
        symbol = {"normal_modulus": "E′", "shear_modulus": "G′", "youngs_modulus": "E"}[kind]
        return f"{symbol} of {of}" if of else symbol

    def _directions(self) -> Table:
        rows = [
            (
                "; ".join(f"{part:+.2f} log {self._symbol(name)}" for name, part in parts.items() if abs(part) > 0.15),
                f"{1 / std:.3g}",
                f"{100 * std:.2g} %",
            )
            for std, parts in self.found.directions()
        ]
        head = ("combination", "singular value", "known to within")
        caption = "Combinations of parameters, the best determined first"
        return Table(caption=caption, head=head, rows=rows, numbers=(1, 2))

    def plot_errors(self) -> Figure:
        """Relative errors of the frequencies, as assumed and as identified."""
        found = self.found
        before = 100 * (found.before_Hz / found.measured_Hz - 1)
        kinds = [("as assumed", before, BEFORE), ("identified", found.error_percent, AFTER)]
        return error_bars(kinds, list(map(str, found.mode)), xlabel="mode", ylabel="model over measured, minus one, %")

    def page(self) -> Page:
        """The report."""
        found, (moduli, frequencies) = self.found, self.tables()
        told = "; ".join(f"mode {m}: {e:+.2f} %" for m, e in zip(found.mode, found.error_percent, strict=True))
        shown = Picture(
            draw=self.plot_errors,
            alt=f"Relative error of every frequency, as assumed and as identified. Identified: {told}.",
            caption="Relative errors of the natural frequencies.",
        )
        known = "What is known by the frequencies alone, without what was assumed beforehand."
        assumed = [
            f"The rig file is right in everything but the moduli of its {'joints' if found.model.joints else 'beams'}.",
            "The errors of the frequencies are independent, and as large as the table says.",
        ]
        return Page(
            title="Identification of moduli from natural frequencies",
            answer=self.sentence,
            facts=f"Rig {found.model.name}; {Path(self.table).name}.",
            sections=[
                Section(title="What was identified", tables=[moduli]),
                Section(title="Measured and modelled", tables=[frequencies], pictures=[shown]),
                Section(title="How well the data determine it", texts=[known], tables=[self._directions()]),
                Section(title="What was assumed", items=assumed),
                Section(title="What is uncertain", items=self._uncertain()),
            ],
            files=(self.table,),
        )

    def _uncertain(self) -> list[str]:
        found, items = self.found, sentences(self.warnings)
        if any(std > OPEN for std, _ in found.directions()):
            items.append("The last of these combinations is open: the frequencies do not determine it.")
        if found.residual_factor > 2:
            items.append(
                f"The frequencies are met {found.residual_factor:.2g} times worse than their own uncertainty says: the "
                "model misses something, and the standard deviations are too small by about as much."
            )
        if not found.fit.solution.settled:
            items.append("The search ended before it came to rest.")
        what = "a joint's damping, nor of its nonlinear law" if found.model.joints else "damping"
        return [*items, f"Natural frequencies say nothing of {what}."]

    def _values(self) -> dict[str, Any]:
        found, joints = self.found, self.found.model.joints
        linear: dict[str, Any] = {}
        for name, value in found.moduli.items():
            estimate, kind = {"value": value, "std": found.moduli_std[name]}, name.partition("[")[0]
            if len(joints) > 1:
                linear.setdefault(kind, []).append(estimate)
            else:
                linear[kind if joints else name] = estimate
        errors = zip(found.mode.tolist(), found.error_percent.tolist(), strict=True)
        return {
            "preload": found.preload if joints else "",
            "linear": linear,
            **({"joints": [joint.name for joint in joints]} if len(joints) > 1 else {}),
            "nonlinear": {},
            "residual_percent": {f"mode {mode}": error for mode, error in errors},
        }


def identify_moduli(path: str | Path, rig: Rig | BeamRig, *, source: str, preload: str | None) -> IdentifiedModuli:
    """Moduli from a table of natural frequencies.

    Raises
    ------
    InputError
        If the table holds sweeps, or as of :func:`~twin.identify.frequency_moduli.moduli_data`.
    """
    table = read_table(path)
    if not isinstance(table, FrequencyTable):
        raise InputError(path, "", "holds sweeps, which need a rig of kind modal", "--rig brake-reuss, for example")
    structure = rig.structure() if isinstance(rig, BeamRig) else rig
    evidence = with_effects(moduli_data(table, structure, source=source, preload=preload), source=source)
    felt, acting = felt_causes(evidence), dict.fromkeys(effect.cause for effect in rig.effect)
    silent = [f"the effect {name} does not act on natural frequencies here" for name in acting if name not in felt]
    found = fit_moduli(evidence)
    return IdentifiedModuli(found=found, table=str(path), nominal=rig, warnings=(*silent, *found.warnings))
