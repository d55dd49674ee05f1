"""What an identification says: parameters, how well the data determine them, residuals, the law and polynomials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from twin.arrays import Array
from twin.identify.base_fit import HELD_PRECISION
from twin.identify.estimate import Estimate
from twin.identify.identified import Identified
from twin.identify.linear.linear_fit import base_prior
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import PolynomialFit, Polynomials
from twin.rigs import LayerLawTable
from twin.views.curves import LawBand, joint_name, law_in_lowest_mode, law_reach
from twin.views.figures import plots_figure
from twin.views.plot import Axis, Plot, PlotCurve
from twin.views.plots import law_plot
from twin.views.style import AFTER, BEFORE, INK, SUPERSCRIPTS, level_colour
from twin.views.table import Table

LITTLE = 2.0
"""A parameter whose uncertainty the data narrow by less than this is assumed rather than identified."""
LAW_PARTS = np.array([1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0])
"""Of the largest amplitudes, where the law is told in numbers."""
UNITS = {"normal_modulus": "N/mm²", "shear_modulus": "N/mm²"}
NAMES = {
    "normal_modulus": "normal modulus E′",
    "shear_modulus": "shear modulus G′",
    "normal_loss_factor": "loss factor of E′",
    "shear_loss_factor": "loss factor of G′",
    "modal_damping": "damping ratio of mode",
}


@dataclass(frozen=True, kw_only=True)
class BaseParameter:
    """A linear parameter of the base family, as assumed and as identified."""

    parameter: str
    joint: str
    """What it is, and whose, where there are several joints; together they are its `name`."""
    unit: str
    nominal: float
    estimate: Estimate
    relative: bool
    """Whether it is fitted as a logarithm; loss factors, which may be zero, are not."""

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.parameter} {self.joint}".strip()


def linear_parameters(linear: Mapping[str, Estimate | list[Estimate]], evidence: MeasuredData) -> list[BaseParameter]:
    """All linear parameters in the order of the model's vector, those of joints and modes one by one."""
    vector, _ = base_prior(nominal_parameters(evidence.rig, evidence.preload))
    found: list[BaseParameter] = []
    for key, entry in linear.items():
        unit, relative = UNITS.get(key, ""), not key.endswith("loss_factor")
        scale = 1e-6 if unit else 1.0
        for number, estimate in enumerate(entry if isinstance(entry, list) else [entry]):
            of_mode, was = key == "modal_damping", float(vector[len(found)])
            found.append(
                BaseParameter(
                    parameter=f"{NAMES[key]} {number + 1}" if of_mode else NAMES[key],
                    joint="" if of_mode else joint_name(evidence, number),
                    unit=unit, nominal=scale * float(np.exp(was) if relative else was),
                    estimate=Estimate(scale * estimate.value, scale * estimate.std), relative=relative,
                )
            )  # fmt: skip
    return found


@dataclass(frozen=True, kw_only=True)
class Determined(BaseParameter):
    """How well the data determine one of them; deviations are of the logarithm where that is fitted."""

    beforehand: float
    """Standard deviation before the data, if all other parameters were known."""
    std: float
    partner: str
    correlation: float
    """The parameter that it is most correlated with, where the model left both free; empty and 0 elsewhere."""

    @property
    def narrowed(self) -> float:
        """How many times narrower the data made what was assumed."""
        return self.beforehand / self.std if self.std > 0 else np.inf

    @property
    def little(self) -> bool:
        """Whether the value is rather assumed than measured."""
        return self.narrowed < LITTLE


def determined(found: Identified, evidence: MeasuredData) -> tuple[Determined, ...]:
    """Every linear parameter, in the order of the model's vector."""
    _, precision = base_prior(nominal_parameters(evidence.rig, evidence.preload))
    # Given the others: all damping ratios are assumed to be alike, so that some tell of one that was never measured.
    beforehand = 1 / np.sqrt(np.diag(precision))
    parameters = linear_parameters(found.linear, evidence)
    rows = []
    for one, assumed, row in zip(parameters, beforehand, _correlation(found, len(parameters)), strict=False):
        partner = int(np.argmax(np.abs(row)))
        strength, estimate = float(row[partner]), one.estimate
        rows.append(
            Determined(
                **vars(one), beforehand=float(assumed),
                std=estimate.std / estimate.value if one.relative else estimate.std,
                partner=parameters[partner].name if strength else "", correlation=strength,
            )
        )  # fmt: skip
    return tuple(rows)


def _correlation(found: Identified, count: int) -> Array:
    """Correlations (p, p) among the first parameters of the fit; 0 on the diagonal and of what the model holds."""
    covariance = found.solution.covariance[:count, :count]
    free = np.diag(found.solution.information)[:count] < 0.1 * HELD_PRECISION
    std = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(std, std)
    correlation[~np.outer(free, free)] = 0.0
    np.fill_diagonal(correlation, 0.0)
    return np.asarray(correlation)


def parameter_table(rows: Sequence[BaseParameter], *, caption: str = "With one standard deviation") -> Table:
    """Assumed and identified."""
    return Table(
        caption=caption,
        head=("parameter", "nominal", "identified", "unit"),
        rows=[(row.name, f"{row.nominal:.4g}", str(row.estimate), row.unit) for row in rows],
        numbers=(1, 2),
    )


def determined_table(rows: tuple[Determined, ...]) -> Table:
    """What each parameter owes to the data, and which other it cannot be told from."""

    def spread(row: Determined, std: float) -> str:
        return f"{100 * std:.2g} %" if row.relative else f"{std:.2g}"

    return Table(
        caption="Each parameter before the data, if all others were known, and after, on the model's mesh",
        head=("parameter", "assumed to within", "known to within", "narrowed", "most correlated with", "correlation"),
        rows=[
            (
                row.name, spread(row, row.beforehand), spread(row, row.std), f"{row.narrowed:.3g}-fold",
                row.partner or "-", f"{row.correlation:+.2f}" if row.partner else "-",
            )
            for row in rows
        ],
        numbers=(1, 2, 3, 5),
    )  # fmt: skip


def residual_table(found: Identified) -> Table:
    """Relative error of every sweep: of the model, and of the papers' polynomials."""
    beside = found.polynomials.residual_percent if found.polynomials is not None else {}
    rows = []
    for sweep, percent in found.residual_percent.items():
        fits = beside.get(sweep, {})
        cells = [f"{fits[key]:.2f} %" if key in fits else "-" for key in ("level", "together")]
        rows.append((sweep, f"{percent:.3f} %", *cells))
    return Table(
        caption="Root-mean-square relative error of the complex response at the reference channel",
        head=("sweep", "model", "polynomials of its level", "polynomials of all levels"),
        rows=rows,
        numbers=(1, 2, 3),
    )


def law_table(softening: LawBand, loss: LawBand) -> Table:
    """The joint's law at parts of the largest opening and slip that any step reached."""
    cells = []
    for band in (softening, loss):
        x = LAW_PARTS * band.reach_m[1]
        value, std = (1e-6 * np.interp(x, band.amplitude_m, curve) for curve in (band.value, band.std))
        texts = [str(Estimate(float(v), float(s))) for v, s in zip(value, std, strict=True)]
        cells.append([(f"{1e6 * at:.3g}", text) for at, text in zip(x, texts, strict=True)])
    return Table(
        caption=f"The law of {softening.joint or 'the joint'} at each point of its layer, up to the largest opening "
        "and slip of any step",
        head=("opening o, µm", "softening s(o), N/mm²", "slip q, µm", "loss l(q), N/mm²"),
        rows=[(*opening, *slip) for opening, slip in zip(*cells, strict=True)],
        numbers=(0, 1, 2, 3),
    )


def polynomial_table(polynomials: Polynomials) -> Table:
    """Coefficients of g1 and g2 with their standard deviations, in N/mm² over powers of mm."""
    rows = []
    for name, fit in {**polynomials.levels, "all levels": polynomials.together}.items():
        for symbol, values, errors in (("g1", fit.softening, fit.std[0]), ("g2", fit.loss, fit.std[1])):
            scale = 1e-6 * 1e-3 ** np.arange(len(values))
            powers = ["", " X", *(f" X{order}".translate(SUPERSCRIPTS) for order in range(2, len(values)))]
            terms = [
                f"({Estimate(value, error)}){power}"
                for value, error, power in zip(values * scale, errors * scale, powers, strict=False)
            ]
            largest = f"{1e3 * fit.largest_amplitude_m:.3g}"
            rows.append((f"{name}: {symbol}", " + ".join(terms), largest, f"{fit.residual_percent:.2g} %"))
    return Table(
        caption="The papers' polynomials, E′ = E′₀ − g1(X) and G′ = G′₀ + j g2(X), in N/mm² with X in mm",
        head=("of", "polynomial", "up to X, mm", "error"),
        rows=rows,
        numbers=(2, 3),
    )


def left_out_table(polynomials: Polynomials) -> Table:
    """Every level predicted by the law of all others."""
    return Table(
        caption="Every level predicted by the polynomials of all others: rms relative error of the complex response",
        head=("left out", "at its amplitudes", "at its forces", "branch not met", "beyond the others"),
        rows=[
            (
                name, f"{one.at_amplitude_percent:.2g} %", f"{one.at_force_percent:.2g} %", f"{one.lost} steps",
                "yes" if one.extrapolated else "no",
            )
            for name, one in polynomials.left_out.items()
        ],
        numbers=(1, 2, 3),
    )  # fmt: skip


def identified_law_figure(found: Identified, evidence: MeasuredData) -> Figure:
    """Softening over opening and loss over slip; below, over a sensor's amplitude, the papers' polynomials."""
    plots = [law_plot({"model": band}) for band in file_law_bands(found, evidence)]
    if found.polynomials is not None:
        plots += _polynomial_plots(found, found.polynomials, evidence)
    return plots_figure(plots, columns=2, height_in=3.1)


def _polynomial_plots(found: Identified, polynomials: Polynomials, evidence: MeasuredData) -> list[Plot]:
    """Each level's polynomials over the amplitudes that they hold for, beside the law as the lowest mode sees it."""
    fits = {**polynomials.levels, "all levels": polynomials.together}
    colours = [level_colour(i + 1) for i in range(len(fits) - 1)] + [INK]
    seen = law_in_lowest_mode(evidence, found)
    plots = []
    for quantity, function in (("softening", "g1(X)"), ("loss", "g2(X)")):
        value, std = 1e-6 * seen.value[quantity], 1e-6 * seen.std[quantity]
        curves = [PlotCurve("model", 1e3 * seen.amplitude_m, value, AFTER, legend=True, std=std)]
        for (name, fit), colour in zip(fits.items(), colours, strict=True):
            X = np.geomspace(min(seen.amplitude_m[0], 0.5 * fit.largest_amplitude_m), fit.largest_amplitude_m, 80)
            g = fit.softening_at(X) if quantity == "softening" else fit.loss_at(X)
            curves.append(PlotCurve(f"polynomials, {name}", 1e3 * X, 1e-6 * g, colour, "dashed", 1.5, legend=True))
        across = f"amplitude X at {evidence.channels[evidence.reference]}, mm"
        x = Axis.over(across, [curve.x for curve in curves], log=True, margin=0.0)
        y = Axis.over(f"{function}, N/mm²", [np.zeros(1), value - std, value + std], margin=0.08)
        plots.append(Plot(title=f"{quantity} as mode {seen.number} sees it: {function}", x=x, y=y, curves=curves))
    return plots


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


def strength_figure(fit: PolynomialFit) -> Figure:
    """The L-curve of the first iteration, its cross-validation, and the residual as the iterations went on."""
    curve, plots = fit.l_curve, []
    marks = (("corner", curve.corner, BEFORE), ("least cross-validation", curve.cross_validated, AFTER))
    for title, across, up, x, y in (
        ("L-curve", "norm of the residual", "norm of the solution", curve.residual_norm, curve.solution_norm),
        ("cross-validation", "strength λ", "left-out error, squared", curve.strength, curve.cross_validation),
    ):
        curves = [PlotCurve("", x, y, INK, size=1.6)]
        for name, strength, colour in marks:
            at = [int(np.argmin(np.abs(curve.strength - strength)))]
            curves.append(PlotCurve(f"{name}: λ = {strength:.2g}", x[at], y[at], colour, "point", 6.0, legend=True))
        plots.append(Plot.over(title, across, up, curves, log="xy"))
    costs = np.array([step.cost for step in fit.history])
    curves = [
        PlotCurve("", np.arange(len(costs)), costs, INK, kind, size) for kind, size in (("line", 1.6), ("point", 3.6))
    ]
    plots.append(Plot.over("iterations", "iteration", "norm of the residual", curves, log="y"))
    return plots_figure(plots, columns=3, height_in=2.7)
