"""Pictures of an identification: the law with the papers' polynomials, and how its regularisation was chosen."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from twin.identify.identified import Identified
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import PolynomialFit
from twin.rigs import LayerLawTable
from twin.views.curves import LawBand, joint_name, law_in_lowest_mode, law_reach
from twin.views.drawing import draw_band, dressed, legend, log_ticks, panels
from twin.views.figures import draw_law, frame_law, unmeasured_entry
from twin.views.style import AFTER, BEFORE, INK, level_colour


def identified_law_figure(found: Identified, evidence: MeasuredData) -> Figure:
    """Softening over opening and loss over slip; below, over a sensor's amplitude, the papers' polynomials.

    Beside the polynomials of each level stands the same law as the lowest mode that was swept sees it.
    """
    bands = file_law_bands(found, evidence)
    rows = len(bands) // 2 + (1 if found.polynomials is not None else 0)
    figure, grid = panels(rows, 2, height_in=0.6 + 3.1 * rows)
    for axes, band in zip(grid.ravel(), bands, strict=False):
        draw_law(axes, band, colour=AFTER, linewidth=1.8, label="model, ± one standard deviation")
        frame_law(axes, band)
    if found.polynomials is not None:
        fits = {**found.polynomials.levels, "all levels": found.polynomials.together}
        colours = [level_colour(i + 1) for i in range(len(fits) - 1)] + [INK]
        seen = law_in_lowest_mode(evidence, found)
        X = 1e3 * seen.amplitude_m
        for axes, quantity in zip(grid[-1], ("softening", "loss"), strict=True):
            value, std = 1e-6 * seen.value[quantity], 1e-6 * seen.std[quantity]
            draw_band(axes, X, value, std, colour=AFTER, linewidth=1.8)
            log_ticks(axes)
            for (name, fit), colour in zip(fits.items(), colours, strict=True):
                _polynomial(axes, fit, quantity, seen.amplitude_m[0], colour=colour, label=f"polynomials, {name}")
            top, bottom = max(0.0, float(np.nanmax(value + std))), min(0.0, float(np.nanmin(value - std)))
            axes.set_ylim(bottom - 0.08 * (top - bottom), top + 0.08 * (top - bottom))
            function = {"softening": "g1(X)", "loss": "g2(X)"}[quantity]
            dressed(
                axes, title=f"{quantity} as mode {seen.number} sees it: {function}",
                xlabel=f"amplitude X at {evidence.channels[evidence.reference]}, mm",
                ylabel=f"{function}, N/mm²",
            )  # fmt: skip
    legend(figure, [unmeasured_entry()], columns=3)
    return figure


def file_law_bands(found: Identified, evidence: MeasuredData) -> tuple[LawBand, ...]:
    """Each joint's law as the model file has it, softening and loss in turn, the constant loss included.

    The standard deviations are those of what a response feels.
    """
    bands = []
    for number, (joint, (opening, slip)) in enumerate(zip(found.rig.joints, law_reach(evidence, found), strict=True)):
        law, name = joint.law, joint_name(evidence, number)
        assert isinstance(law, LayerLawTable)
        for quantity, knots, reach in (("softening", law.opening_m, opening), ("loss", law.slip_m, slip)):
            value, std = (np.array(getattr(law, key)[1:]) for key in (quantity, f"{quantity}_std"))
            x = np.array(knots[1:])
            bands.append(LawBand(quantity=quantity, joint=name, amplitude_m=x, value=value, std=std, reach_m=reach))
    return tuple(bands)


def _polynomial(axes: Axes, fit: PolynomialFit, quantity: str, smallest_m: float, *, colour: str, label: str) -> None:
    """One fit over the amplitudes that it holds for."""
    X = np.geomspace(min(smallest_m, 0.5 * fit.largest_amplitude_m), fit.largest_amplitude_m, 80)
    value = fit.softening_at(X) if quantity == "softening" else fit.loss_at(X)
    axes.plot(1e3 * X, 1e-6 * value, color=colour, linestyle="--", linewidth=1.2, label=label)


def strength_figure(fit: PolynomialFit) -> Figure:
    """The L-curve of the first iteration, its cross-validation, and the residual as the iterations went on."""
    curve = fit.l_curve
    figure, ((left, middle, right),) = panels(1, 3, height_in=3.3)
    marks = (("corner", curve.corner, BEFORE, "o"), ("least cross-validation", curve.cross_validated, AFTER, "s"))
    left.loglog(curve.residual_norm, curve.solution_norm, color=INK, linewidth=1.3)
    middle.loglog(curve.strength, curve.cross_validation, color=INK, linewidth=1.3)
    for name, strength, colour, marker in marks:
        at, label = int(np.argmin(np.abs(curve.strength - strength))), f"{name}: λ = {strength:.2g}"
        left.plot(curve.residual_norm[at], curve.solution_norm[at], marker, color=colour, markersize=7, label=label)
        middle.plot(strength, curve.cross_validation[at], marker, color=colour, markersize=7)
    dressed(left, title="L-curve", xlabel="norm of the residual", ylabel="norm of the solution")
    dressed(middle, title="cross-validation", xlabel="strength λ", ylabel="left-out error, squared")
    costs = [step.cost for step in fit.history]
    right.semilogy(range(len(costs)), costs, color=INK, marker="o", markersize=4, linewidth=1.3)
    dressed(right, title="iterations", xlabel="iteration", ylabel="norm of the residual")
    for axis in (left.xaxis, left.yaxis, middle.xaxis, middle.yaxis, right.yaxis):
        _few_ticks(axis)
    right.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    legend(figure)
    return figure


def _few_ticks(axis: Axis) -> None:
    """Round numbers on a logarithmic axis; powers of ten alone may leave it bare."""
    low, high = axis.get_view_interval()
    if high < 20 * low:
        axis.set_major_locator(MaxNLocator(4))
        axis.set_major_formatter("{x:g}")
    else:
        axis.set_major_locator(LogLocator(numticks=5))
