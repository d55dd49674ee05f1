"""One mode whose frequency and damping follow its amplitude, identified from a table of sweeps."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twin.identify.backbones.modal_table import identify_sweep_table
from twin.identify.rms import rms
from twin.lab.model_result import IdentifiedModel
from twin.rigs.modal import ModalLaw, ModalRig
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.page import Page, Picture, Section
from twin.views.style import AFTER, BEFORE, MEASURED
from twin.views.table import Table


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class IdentifiedMode(IdentifiedModel):
    """A modal rig with its law and levels, identified from the table of sweeps in the file `table`."""

    model: ModalRig
    table: str

    @property
    def file(self) -> ModalRig:
        """The rig file with what was identified."""
        return self.model

    @property
    def sentence(self) -> str:
        """How far the mode moves, and how well a level that was left out is predicted."""
        law, levels = self._law, self.model.level
        inner = [level.left_out_force_rms for level in levels[1:-1] if not level.shifted]
        shifted = [level.level for level in levels if level.shifted]
        told = (
            f"The resonance moves from {law.frequency_Hz[0]:.5g} to {law.frequency_Hz[-1]:.5g} Hz and its damping "
            f"ratio from {law.damping_ratio[0]:.3g} to {law.damping_ratio[-1]:.3g} over the amplitudes measured"
        )
        if inner:
            error = 100 * rms(inner)
            told += f"; a level that was left out is predicted to {error:.2g} % of its force"
        if shifted:
            told += f", except sweep {', '.join(shifted)}, which was shifted as a whole"
        return f"{told}."

    def tables(self) -> Sequence[Table]:
        """Every sweep by itself, and predicted from all others."""
        head = ("sweep", "amplitude, m/s²", "resonance, Hz", "damping ratio", "off the law, Hz", "force error")
        rows = [
            (
                level.level + (", shifted" if level.shifted else ""), f"{level.amplitude_m_per_s2:.3g}",
                f"{level.frequency_Hz:.3f}", f"{level.damping_ratio:.5f}",
                f"{level.left_out_frequency_error_Hz:+.3f}", f"{100 * level.left_out_force_rms:.1f} %",
            )
            for level in self.model.level
        ]  # fmt: skip
        caption = "Every sweep by itself, and predicted from all others"
        return [Table(caption=caption, head=head, rows=rows, numbers=range(1, 6))]

    def plot_law(self) -> Figure:
        """Resonance and damping ratio against amplitude: each sweep by itself, the law with one standard deviation."""
        law = self._law
        a, frequency, damping = (np.array(v) for v in (law.amplitude_m_per_s2, law.frequency_Hz, law.damping_ratio))
        spreads = (np.array(law.frequency_std_Hz), damping * np.array(law.damping_relative_std))
        points = np.array([(v.amplitude_m_per_s2, v.frequency_Hz, v.damping_ratio) for v in self.model.level])
        shifted = np.array([v.shifted for v in self.model.level])
        figure, (row,) = panels(1, 2, height_in=3.4)
        for axes, curve, std, column, label in zip(
            row, (frequency, damping), spreads, (1, 2), ("resonance, Hz", "damping ratio"), strict=True
        ):
            draw_band(axes, a, curve, std, colour=AFTER, label="law, ± one standard deviation")
            axes.plot(points[~shifted, 0], points[~shifted, column], "o", color=MEASURED, markersize=5, label="sweep")
            if shifted.any():
                axes.plot(points[shifted, 0], points[shifted, column], "s", color=BEFORE, markersize=6, label="shifted")
            dressed(axes, xlabel=f"amplitude at {self.model.channel}, m/s²", ylabel=label)
        legend(figure)
        return figure

    def page(self) -> Page:
        """The report."""
        told = "; ".join(f"{v.amplitude_m_per_s2:.3g} m/s²: {v.frequency_Hz:.3f} Hz" for v in self.model.level)
        shown = Picture(
            draw=self.plot_law,
            alt=f"Resonance and damping ratio of every sweep against its amplitude, with the law. {told}.",
            caption="Each sweep's own linear mode (points) and the smooth law of all, with one standard deviation.",
        )
        identified = (
            f"Modal mass {self._law.modal_mass_kg:.4g} kg; each force is met to "
            f"{100 * self._law.force_relative_std:.2g} % by its sweep's own linear mode."
        )
        assumed = [
            "One mode, linear at each amplitude; its frequency and damping follow the response's amplitude smoothly, "
            "and what other modes add is constant.",
            "The response was held during each sweep, so that each sweep is one amplitude.",
        ]
        uncertain = [
            *self.warnings,
            "The lowest and the highest amplitude are extrapolated from the others when they are left out.",
            "Standard deviations include how far whole sweeps stray from any smooth law.",
        ]
        return Page(
            title="Identification of a mode that depends on its amplitude",
            answer=self.sentence,
            facts=f"Rig {self.model.name}; {Path(self.table).name}.",
            sections=[
                Section(title="What was identified", texts=[identified], tables=self.tables(), pictures=[shown]),
                Section(title="What was assumed", items=assumed),
                Section(title="What is uncertain", items=uncertain),
            ],
            files=(self.table,),
        )

    @property
    def _law(self) -> ModalLaw:
        assert self.model.law is not None
        return self.model.law

    def _values(self) -> dict[str, Any]:
        law, damping = self._law, self._law.damping_ratio[0]
        return {
            "linear": {
                "natural_frequency_Hz": {"value": law.frequency_Hz[0], "std": law.frequency_std_Hz[0]},
                "damping_ratio": {"value": damping, "std": damping * law.damping_relative_std[0]},
                "modal_mass_kg": {"value": law.modal_mass_kg, "std": None},
            },
            "nonlinear": {"law": law.model_dump(), "levels": [level.model_dump() for level in self.model.level]},
            "residual_percent": {level.level: 100 * level.left_out_force_rms for level in self.model.level},
        }


def identify_mode(path: str | Path, rig: ModalRig) -> IdentifiedMode:
    """The law of one mode from a table of sweeps."""
    model = identify_sweep_table(Path(path), rig)
    return IdentifiedMode(model=model, table=str(path), warnings=tuple(model.note))
