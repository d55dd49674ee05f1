"""Pictures of an identification: the law with the papers' polynomials, and how its regularisation was chosen."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator

from twin.identify.identified import Identified
from twin.identify.polynomial_law import PolynomialFit
from twin.identify.regularisation import LCurve
from twin.views.figures import dressed, legend, panels
from twin.views.style import AFTER, BEFORE, INK, level_colour

__all__ = ["identified_law_figure", "strength_figure"]

POINTS = 80


def identified_law_figure(found: Identified) -> Figure:
    """Softening and loss with one standard deviation, and the polynomials of each level and of all together."""
    law = found.rig.joint.law
    assert law is not None
    X = np.array(law.amplitude_m)
    # The file measures amplitude at the identified resonance, the fits at the believed one.
    measure = X[-1] / found.unknowns.law.knots[-1]
    figure, row = panels(2, height_in=3.6)
    for axes, quantity in zip(row, ("softening", "loss"), strict=True):
        value, std = (1e-6 * np.array(getattr(law, name)) for name in (quantity, f"{quantity}_std"))
        axes.fill_between(1e3 * X, value - std, value + std, color=AFTER, alpha=0.22, linewidth=0)
        axes.semilogx(1e3 * X, value, color=AFTER, linewidth=1.8)
        if found.polynomials is not None:
            fits = [*found.polynomials.levels.values(), found.polynomials.together]
            for i, fit in enumerate(fits):
                last = i == len(fits) - 1
                _polynomial(axes, fit, quantity, X[1], measure, colour=INK if last else level_colour(i + 1))
        top, bottom = max(0.0, float((value + std).max())), min(0.0, float((value - std).min()))
        axes.set_ylim(bottom - 0.08 * (top - bottom), top + 0.08 * (top - bottom))
        axes.set_xlim(1e3 * X[1], 1e3 * X[-1])
        title = "softening: E′ = E′₀ − s(X)" if quantity == "softening" else "loss modulus l(X)"
        axes.set(title=title, xlabel=f"amplitude X at {law.channel}, mm", ylabel=f"{title[0]}(X), N/mm²")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        dressed(axes)
    entries = [Line2D([], [], color=AFTER, linewidth=1.8, label="model, ± one standard deviation")]
    if found.polynomials is not None:
        names = [*found.polynomials.levels, "all levels"]
        entries += [
            Line2D(
                [], [], color=INK if i == len(names) - 1 else level_colour(i + 1), linestyle="--",
                label=f"polynomials, {name}",
            )
            for i, name in enumerate(names)
        ]  # fmt: skip
    legend(figure, entries, columns=3)
    return figure


def _polynomial(
    axes: Axes, fit: PolynomialFit, quantity: str, smallest_m: float, measure: float, *, colour: str
) -> None:
    """One fit over the amplitudes that it holds for."""
    X = np.geomspace(min(smallest_m / measure, 0.5 * fit.largest_amplitude_m), fit.largest_amplitude_m, POINTS)
    value = fit.softening_at(X) if quantity == "softening" else fit.loss_at(X)
    axes.plot(1e3 * measure * X, 1e-6 * value, color=colour, linestyle="--", linewidth=1.2)


def strength_figure(fit: PolynomialFit) -> Figure:
    """The L-curve of the first iteration, its cross-validation, and the residual as the iterations went on."""
    curve = fit.l_curve
    figure, (left, middle, right) = panels(3, height_in=3.3)
    marks = (("corner", curve.corner, BEFORE, "o"), ("least cross-validation", curve.cross_validated, AFTER, "s"))
    left.loglog(curve.residual_norm, curve.solution_norm, color=INK, linewidth=1.3)
    middle.loglog(curve.strength, curve.cross_validation, color=INK, linewidth=1.3)
    for _, strength, colour, marker in marks:
        at = _at(curve, strength)
        left.plot(curve.residual_norm[at], curve.solution_norm[at], marker, color=colour, markersize=7)
        middle.plot(strength, curve.cross_validation[at], marker, color=colour, markersize=7)
    left.set(title="L-curve", xlabel="norm of the residual", ylabel="norm of the solution")
    middle.set(title="cross-validation", xlabel="strength λ", ylabel="left-out error, squared")
    costs = [step.cost for step in fit.history]
    right.semilogy(range(len(costs)), costs, color=INK, marker="o", markersize=4, linewidth=1.3)
    right.set(title="iterations", xlabel="iteration", ylabel="norm of the residual")
    for axes in (left, middle, right):
        dressed(axes)
        _few_ticks(axes.yaxis)
    for axes in (left, middle):
        _few_ticks(axes.xaxis)
    right.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    entries = [
        Line2D([], [], color=colour, marker=marker, linestyle="none", label=f"{name}: λ = {strength:.2g}")
        for name, strength, colour, marker in marks
    ]
    legend(figure, entries)
    return figure


def _few_ticks(axis: Axis) -> None:
    """Round numbers on a logarithmic axis; powers of ten alone may leave it bare."""
    low, high = axis.get_view_interval()
    if high < 20 * low:
        axis.set_major_locator(MaxNLocator(4))
        axis.set_major_formatter("{x:g}")
    else:
        axis.set_major_locator(LogLocator(numticks=5))


def _at(curve: LCurve, strength: float) -> int:
    return int(np.argmin(np.abs(curve.strength - strength)))
