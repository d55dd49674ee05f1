"""The report of one mode whose frequency and damping follow its amplitude, identified from a table of sweeps."""

import numpy as np
from matplotlib.figure import Figure

from twin.rigs.modal import ModalRig
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.page import Page, Picture, Section
from twin.views.style import AFTER, BEFORE, MEASURED
from twin.views.table import Table


def mode_sentence(model: ModalRig) -> str:
    """The answer in one sentence."""
    law = model.law
    assert law is not None
    inner = [level for level in model.level[1:-1] if not level.shifted]
    error = 100 * float(np.sqrt(np.mean([level.left_out_force_rms**2 for level in inner]))) if inner else np.nan
    shifted = [level.level for level in model.level if level.shifted]
    told = (
        f"The resonance moves from {law.frequency_Hz[0]:.5g} to {law.frequency_Hz[-1]:.5g} Hz and its damping ratio "
        f"from {law.damping_ratio[0]:.3g} to {law.damping_ratio[-1]:.3g} over the amplitudes measured"
    )
    if np.isfinite(error):
        told += f"; a level that was left out is predicted to {error:.2g} % of its force"
    if shifted:
        told += f", except sweep {', '.join(shifted)}, which was shifted as a whole"
    return f"{told}."


def mode_table(model: ModalRig) -> Table:
    """Every sweep by itself, and by the law of all others."""
    return Table(
        caption="Every sweep by itself, and predicted from all others",
        head=("sweep", "amplitude, m/s²", "resonance, Hz", "damping ratio", "off the law, Hz", "force error"),
        rows=[
            (
                level.level + (", shifted" if level.shifted else ""), f"{level.amplitude_m_per_s2:.3g}",
                f"{level.frequency_Hz:.3f}", f"{level.damping_ratio:.5f}",
                f"{level.left_out_frequency_error_Hz:+.3f}", f"{100 * level.left_out_force_rms:.1f} %",
            )
            for level in model.level
        ],
        numbers=(1, 2, 3, 4, 5),
    )  # fmt: skip


def mode_figure(model: ModalRig) -> Figure:
    """Frequency and damping ratio over the amplitude: each sweep by itself, and the law with one standard deviation."""
    law = model.law
    assert law is not None
    a = np.array(law.amplitude_m_per_s2)
    frequency, damping = np.array(law.frequency_Hz), np.array(law.damping_ratio)
    spreads = (np.array(law.frequency_std_Hz), damping * np.array(law.damping_relative_std))
    figure, (row,) = panels(1, 2, height_in=3.4)
    points = np.array([(v.amplitude_m_per_s2, v.frequency_Hz, v.damping_ratio) for v in model.level])
    shifted = np.array([v.shifted for v in model.level])
    for axes, curve, std, column, label in zip(
        row, (frequency, damping), spreads, (1, 2), ("resonance, Hz", "damping ratio"), strict=True
    ):
        draw_band(axes, a, curve, std, colour=AFTER, label="law, ± one standard deviation")
        axes.plot(points[~shifted, 0], points[~shifted, column], "o", color=MEASURED, markersize=5, label="sweep")
        if shifted.any():
            axes.plot(points[shifted, 0], points[shifted, column], "s", color=BEFORE, markersize=6, label="shifted")
        dressed(axes, xlabel=f"amplitude at {model.channel}, m/s²", ylabel=label)
    legend(figure)
    return figure


def mode_page(model: ModalRig, *, table: str) -> Page:
    """The report of an identified modal rig, with its law and levels; `table` names the table of sweeps."""
    law = model.law
    assert law is not None
    told = "; ".join(f"{v.amplitude_m_per_s2:.3g} m/s²: {v.frequency_Hz:.3f} Hz" for v in model.level)
    shown = Picture(
        draw=lambda: mode_figure(model),
        alt=f"Resonance and damping ratio of every sweep against its amplitude, with the law. {told}.",
        caption="Each sweep's own linear mode (points) and the smooth law of all, with one standard deviation.",
    )
    identified = Section(
        title="What was identified",
        texts=[
            f"Modal mass {law.modal_mass_kg:.4g} kg; each force is met to {100 * law.force_relative_std:.2g} % by "
            "its sweep's own linear mode."
        ],
        tables=[mode_table(model)],
        pictures=[shown],
    )
    assumed = Section(
        title="What was assumed",
        items=[
            "One mode, linear at each amplitude; its frequency and damping follow the response's amplitude "
            "smoothly, and what other modes add is constant.",
            "The response was held during each sweep, so that each sweep is one amplitude.",
        ],
    )
    uncertain = Section(
        title="What is uncertain",
        items=[
            *model.note,
            "The lowest and the highest amplitude are extrapolated from the others when they are left out.",
            "Standard deviations include how far whole sweeps stray from any smooth law.",
        ],
    )
    return Page(
        title="Identification of a mode that depends on its amplitude",
        answer=mode_sentence(model),
        facts=f"Rig {model.name}; {table}.",
        sections=[identified, assumed, uncertain],
    )
