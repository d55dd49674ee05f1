"""The report of moduli identified from natural frequencies."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from twin.identify.eigensensitivity import FrequencyUpdate
from twin.identify.estimate import Estimate
from twin.identify.identifiability import weak_directions
from twin.views.answer import estimate_text
from twin.views.figures import bars, legend, panels
from twin.views.page import Page, Picture, Section
from twin.views.style import AFTER, BEFORE, INK
from twin.views.table import Table

OPEN = 1.0
"""Relative standard deviation from which on the frequencies leave a combination open."""


def moduli_sentence(update: FrequencyUpdate) -> str:
    """The answer in one sentence."""
    moduli = " and ".join(f"{row[0]} = {row[2]} N/mm²" for row in moduli_table(update, {}).rows)
    count = sum(len(f) for f in update.measured.values())
    return f"{moduli} meet the {count} natural frequencies within {update.worst_percent:.2g} %."


def moduli_table(update: FrequencyUpdate, nominal: dict[str, float]) -> Table:
    """Moduli in N/mm², with their standard deviations; `nominal` as the update names them, in N/m²."""
    rows = []
    for name in update.names:
        plain = name.partition("[")[0]
        was = f"{1e-6 * nominal[name]:.4g}" if name in nominal else ""
        estimate = Estimate(1e-6 * update.values[name], 1e-6 * update.std[name])
        rows.append(({"normal_modulus": "E′", "shear_modulus": "G′"}.get(plain, name), was, estimate_text(estimate)))
    return Table(
        caption="Moduli in N/mm², with one standard deviation",
        head=("modulus", "nominal", "identified"),
        rows=rows,
        numbers=(1, 2),
    )


def frequency_table(update: FrequencyUpdate, modes: Sequence[int]) -> Table:
    """Measured and modelled natural frequencies."""
    rows = []
    for condition, measured in update.measured.items():
        before, after = update.before[condition], update.after[condition]
        rows += [
            (
                str(mode),
                f"{f:.5g}",
                f"{b:.5g}",
                f"{100 * (b / f - 1):+.2f} %",
                f"{a:.5g}",
                f"{100 * (a / f - 1):+.2f} %",
            )
            for mode, f, b, a in zip(modes, measured, before, after, strict=True)
        ]
    return Table(
        caption="Natural frequencies in Hz; errors are model over measured, minus one",
        head=("mode", "measured", "as assumed", "error", "identified", "error"),
        rows=rows,
        numbers=(0, 1, 2, 3, 4, 5),
    )


def errors_figure(update: FrequencyUpdate, modes: Sequence[int]) -> Figure:
    """Relative errors of all frequencies, as assumed and as identified."""
    figure, (axes,) = panels(1, height_in=3.0)
    kinds = [
        (label, np.concatenate([100 * (model[name] / f - 1) for name, f in update.measured.items()]), colour)
        for label, model, colour in (("as assumed", update.before, BEFORE), ("identified", update.after, AFTER))
    ]
    bars(axes, kinds, [str(mode) for mode in modes])
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.set(xlabel="mode", ylabel="model over measured, minus one, %")
    legend(figure, axes.get_legend_handles_labels()[0])
    return figure


def moduli_page(
    update: FrequencyUpdate,
    *,
    rig: str,
    table: str,
    modes: Sequence[int],
    nominal: dict[str, float],
    warnings: Sequence[str],
) -> Page:
    """The report of one table's moduli.

    Parameters
    ----------
    update
        What the frequencies say.
    rig, table
        Names of the rig, and of the table's file.
    modes
        Number of each frequency's mode, in the table's order.
    nominal
        Moduli as the rig file has them, named as in the update, N/m².
    warnings
        What to know beside it.
    """
    errors = update.error_percent.values()
    told = "; ".join(f"mode {m}: {-e:+.2f} %" for m, e in zip(modes, np.concatenate(list(errors)), strict=True))
    shown = Picture(
        draw=lambda: errors_figure(update, modes),
        alt=f"Relative error of every frequency, as assumed and as identified. Identified: {told}.",
        caption="Relative errors of the natural frequencies.",
    )
    return Page(
        title="Identification of moduli from natural frequencies",
        answer=moduli_sentence(update),
        facts=f"Rig {rig}; {table}.",
        sections=[
            Section(title="What was identified", tables=[moduli_table(update, nominal)]),
            Section(title="Measured and modelled", tables=[frequency_table(update, modes)], pictures=[shown]),
            _determined(update),
            Section(
                title="What was assumed",
                items=[
                    "The rig file is right in everything but the moduli of the layer.",
                    "The errors of the frequencies are independent, and as large as the table says.",
                ],
            ),
            Section(title="What is uncertain", items=_uncertain(update, warnings)),
        ],
    )


def _determined(update: FrequencyUpdate) -> Section:
    rows = [
        (
            "; ".join(f"{part:+.2f} log {name.partition('[')[0]}" for name, part in direction.combination.items()),
            f"{direction.singular_value:.3g}",
            f"{100 * direction.relative_std:.2g} %",
        )
        for direction in weak_directions(update)
    ]
    table = Table(
        caption="Combinations of parameters, the best determined first",
        head=("combination", "singular value", "known to within"),
        rows=rows,
        numbers=(1, 2),
    )
    told = "by the frequencies alone, without what was assumed beforehand"
    return Section(title="How well the data determine it", texts=[f"What is known {told}."], tables=[table])


def _uncertain(update: FrequencyUpdate, warnings: Sequence[str]) -> list[str]:
    items = [text[0].upper() + text[1:] + "." for text in warnings]
    if any(direction.relative_std > OPEN for direction in weak_directions(update)):
        items.append("The last of these combinations is open: the frequencies do not determine it.")
    if np.isfinite(update.residual_factor) and update.residual_factor > 2:
        items.append(
            f"The frequencies are met {update.residual_factor:.2g} times worse than their own uncertainty says: the "
            "model misses something, and the standard deviations are too small by about as much."
        )
    if not update.converged:
        items.append("The search ended before it came to rest.")
    items.append("Natural frequencies say nothing of the joint's damping, nor of its nonlinear law.")
    return items
