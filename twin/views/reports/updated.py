"""The report of a rig updated to frequency responses: what they tell, pairs of modes, responses."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from twin.identify.estimate import Estimate
from twin.identify.responses.updating import Updated
from twin.views.drawing import dressed, legend, panels
from twin.views.figures import draw_measured
from twin.views.page import Page, Picture, Section
from twin.views.receptance import response_label
from twin.views.reports.answer import estimate_text
from twin.views.style import AFTER
from twin.views.table import Table


def updated_sentence(found: Updated) -> str:
    """The answer in one sentence."""
    told = [one.name for one in found.values if one.told]
    worst = max((abs(100 * (pair.after_Hz / pair.measured_Hz - 1)) for pair in found.pairs), default=0.0)
    what = f"{', '.join(told)} updated" if told else "no number of the rig file is told by these data"
    return f"{what}; {len(found.pairs)} natural frequencies met within {worst:.2g} %."


def values_table(found: Updated) -> Table:
    """Numbers of the rig file before and after."""
    rows = [
        (one.name, one.unit, estimate_text(one.before), estimate_text(one.after), "yes" if one.told else "hardly")
        for one in found.values
    ]
    return Table(
        caption="Numbers of the rig file, with one standard deviation",
        head=("number", "unit", "assumed", "updated", "told by the data"),
        rows=rows, numbers=(2, 3),
    )  # fmt: skip


def pairs_table(found: Updated) -> Table:
    """Pairs of measured and modelled modes."""
    rows = []
    for pair in found.pairs:
        f, before, after = pair.measured_Hz, pair.before_Hz, pair.after_Hz
        rows.append((
            str(pair.mode), f"{f:.5g}", f"{before:.5g}", f"{100 * (before / f - 1):+.2f} %", f"{after:.5g}",
            f"{100 * (after / f - 1):+.2f} %", _mac(pair.mac_before), _mac(pair.mac_after),
        ))  # fmt: skip
    return Table(
        caption="Natural frequencies in Hz; errors are model over measured, minus one",
        head=("mode", "measured", "as assumed", "error", "updated", "error", "MAC before", "MAC after"),
        rows=rows, numbers=tuple(range(8)),
    )  # fmt: skip


def _mac(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def damping_table(found: Updated) -> Table:
    """Damping ratios of the modes that show."""
    rows = [(str(mode), estimate_text(Estimate(100 * one.value, 100 * one.std))) for mode, one in found.damping.items()]
    return Table(caption="Damping ratios, per cent", head=("mode", "ratio"), rows=rows, numbers=(0, 1))


def responses_figure(found: Updated, index: int = 0) -> Figure:
    """Measured and modelled responses of one case."""
    assert found.found is not None
    evidence = found.found.evidence
    data = evidence.broadband[index]
    figure, (row,) = panels(1, len(data.channels), height_in=3.2)
    predicted = np.abs(found.predicted(index))
    for o, (axes, channel) in enumerate(zip(row, data.channels, strict=True)):
        draw_measured(axes, data.frequency_Hz, np.abs(data.H[:, o]))
        axes.semilogy(data.frequency_Hz, predicted[:, o], color=AFTER, label="updated model", linewidth=0.9)
        label = response_label(channel, evidence.units[channel])
        dressed(axes, title=channel, xlabel="frequency, Hz", ylabel=label)
    legend(figure)
    return figure


def updated_page(found: Updated) -> Page:
    """The report."""
    pictures = (
        [
            Picture(
                draw=lambda: responses_figure(found),
                alt="Measured frequency responses and those of the updated model.",
                caption="Responses of the first case, in bins, and the updated model's.",
            )
        ]
        if found.found is not None
        else []
    )
    values = [values_table(found)] if found.values else []
    return Page(
        title="A rig updated to frequency responses",
        answer=updated_sentence(found),
        facts=f"Rig {found.rig.name}; {', '.join(found.sources)}.",
        sections=[
            Section(title="What was updated", tables=values),
            Section(
                title="Measured and modelled", tables=[pairs_table(found), damping_table(found)], pictures=pictures
            ),
            Section(title="What is uncertain", items=_uncertain(found)),
        ],
    )


def _uncertain(found: Updated) -> Sequence[str]:
    hardly = [one.name for one in found.values if not one.told]
    items = [f"{', '.join(hardly)}: rather assumed than measured."] if hardly else []
    items += [f"{note[0].upper()}{note[1:]}." for note in found.notes]
    items.append(
        "What these numbers leave of natural frequencies and of what sensors show of each mode is in the model."
    )
    items.append("Frequency responses have no force level: nothing is said of a joint's nonlinear law.")
    return items
