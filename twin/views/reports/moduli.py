"""The report of moduli identified from natural frequencies."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from twin.identify.estimate import Estimate
from twin.identify.frequency_moduli import FrequencyModuli
from twin.views.figures import error_bars
from twin.views.page import Page, Picture, Section
from twin.views.reports.answer import estimate_text
from twin.views.style import AFTER, BEFORE
from twin.views.table import Table

OPEN = 1.0
"""Standard deviation of a logarithm from which on the frequencies leave a combination open."""


def moduli_sentence(found: FrequencyModuli) -> str:
    """The answer in one sentence."""
    moduli = " and ".join(f"{row[0]} = {row[2]} N/mm²" for row in moduli_table(found).rows)
    worst = float(np.max(np.abs(found.error_percent)))
    return f"{moduli} meet the {len(found.mode)} natural frequencies within {worst:.2g} %."


def moduli_table(found: FrequencyModuli) -> Table:
    """Moduli in N/mm², with their standard deviations."""
    rows = []
    for name, was in found.nominal.items():
        estimate = Estimate(1e-6 * found.moduli[name], 1e-6 * found.moduli_std[name])
        rows.append((_symbol(name, found), f"{1e-6 * was:.4g}", estimate_text(estimate)))
    return Table(
        caption="Moduli in N/mm², with one standard deviation",
        head=("modulus", "nominal", "identified"),
        rows=rows,
        numbers=(1, 2),
    )


def _symbol(name: str, found: FrequencyModuli) -> str:
    """Of a modulus, with the joint or the beams whose it is where there are several."""
    kind, _, of = name.removesuffix("]").partition("[")
    if len(found.model.joints) == 1:
        of = ""
    elif found.model.joints:
        of = of.removesuffix(f", {found.preload}")
    symbol = {"normal_modulus": "E′", "shear_modulus": "G′", "youngs_modulus": "E"}[kind]
    return f"{symbol} of {of}" if of else symbol


def frequency_table(found: FrequencyModuli) -> Table:
    """Measured and modelled natural frequencies."""
    columns = (found.mode, found.measured_Hz, found.before_Hz, found.after_Hz)
    return Table(
        caption="Natural frequencies in Hz; errors are model over measured, minus one",
        head=("mode", "measured", "as assumed", "error", "identified", "error"),
        rows=[
            (
                str(mode), f"{f:.5g}", f"{b:.5g}", f"{100 * (b / f - 1):+.2f} %", f"{a:.5g}",
                f"{100 * (a / f - 1):+.2f} %",
            )
            for mode, f, b, a in zip(*columns, strict=True)
        ],
        numbers=(0, 1, 2, 3, 4, 5),
    )  # fmt: skip


def errors_figure(found: FrequencyModuli) -> Figure:
    """Relative errors of all frequencies, as assumed and as identified."""
    before = 100 * (found.before_Hz / found.measured_Hz - 1)
    kinds = [("as assumed", before, BEFORE), ("identified", found.error_percent, AFTER)]
    names = [str(mode) for mode in found.mode]
    return error_bars(kinds, names, xlabel="mode", ylabel="model over measured, minus one, %")


def moduli_page(found: FrequencyModuli, *, table: str, warnings: Sequence[str] = ()) -> Page:
    """The report of one table's moduli; `table` is its file's name."""
    told = "; ".join(f"mode {m}: {e:+.2f} %" for m, e in zip(found.mode, found.error_percent, strict=True))
    shown = Picture(
        draw=lambda: errors_figure(found),
        alt=f"Relative error of every frequency, as assumed and as identified. Identified: {told}.",
        caption="Relative errors of the natural frequencies.",
    )
    joints = found.model.joints
    return Page(
        title="Identification of moduli from natural frequencies",
        answer=moduli_sentence(found),
        facts=f"Rig {found.model.name}; {table}.",
        sections=[
            Section(title="What was identified", tables=[moduli_table(found)]),
            Section(title="Measured and modelled", tables=[frequency_table(found)], pictures=[shown]),
            _determined(found),
            Section(
                title="What was assumed",
                items=[
                    f"The rig file is right in everything but the moduli of {'its joints' if joints else 'its beams'}.",
                    "The errors of the frequencies are independent, and as large as the table says.",
                ],
            ),
            Section(title="What is uncertain", items=_uncertain(found, warnings)),
        ],
    )


def _determined(found: FrequencyModuli) -> Section:
    rows = [
        (
            "; ".join(
                f"{part:+.2f} log {_symbol(name, found)}" for name, part in combination.items() if abs(part) > 0.15
            ),
            f"{1 / std:.3g}",
            f"{100 * std:.2g} %",
        )
        for std, combination in found.directions()
    ]
    table = Table(
        caption="Combinations of parameters, the best determined first",
        head=("combination", "singular value", "known to within"),
        rows=rows,
        numbers=(1, 2),
    )
    told = "by the frequencies alone, without what was assumed beforehand"
    return Section(title="How well the data determine it", texts=[f"What is known {told}."], tables=[table])


def _uncertain(found: FrequencyModuli, warnings: Sequence[str]) -> list[str]:
    items = [text[0].upper() + text[1:] + "." for text in warnings]
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
    items.append(f"Natural frequencies say nothing of {what}.")
    return items
