"""A plot as numbers: axes, curves, and what its legend tells; reports draw it by matplotlib, views by rerun."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array

Range = tuple[float, float]


def common_range(values: Sequence[Array], *, log: bool = False, margin: float = 0.06) -> Range:
    """Range of all finite values with a margin; positive ones alone where the axis is logarithmic."""
    flat = np.concatenate([np.ravel(np.asarray(v, float)) for v in values] or [np.zeros(0)])
    flat = flat[np.isfinite(flat) & ((flat > 0) | (not log))]
    if len(flat) == 0:
        return (0.1, 1.0) if log else (0.0, 1.0)
    low, high = float(flat.min()), float(flat.max())
    if log:
        low = max(low, high * 1e-7)
        grow = (high / low) ** margin if high > low else 1.5
        return low / grow, high * grow
    grow = margin * (high - low) or 0.05 * abs(high) or 1.0
    return low - grow, high + grow


@dataclass(frozen=True)
class Axis:
    """Quantity and unit, as printed, and the ends, in data; `bare` without ticks, where it only keeps things apart."""

    label: str
    ends: Range
    log: bool = False
    bare: bool = False

    @classmethod
    def over(cls, label: str, values: Sequence[Array], *, log: bool = False, margin: float = 0.06) -> Axis:
        """An axis over :func:`common_range`."""
        return cls(label, common_range(values, log=log, margin=margin), log=log)

    def share(self, values: Array) -> Array:
        """Where values lie, 0 at the first end and 1 at the last."""
        if self.log:
            return np.asarray(np.log(values / self.ends[0]) / np.log(self.ends[1] / self.ends[0]))
        return np.asarray((values - self.ends[0]) / (self.ends[1] - self.ends[0]))


@dataclass(frozen=True)
class PlotCurve:
    """A curve of a plot, or markers, as `kind` says: ``line``, ``dashed`` or ``point``; in reports also others.

    `name` is the legend's where it has a place there; `size` is its width, or a marker's radius; `std` is a standard
    deviation to either side.
    """

    name: str
    x: Array
    y: Array
    colour: str
    kind: str = "line"
    size: float = 2.0
    legend: bool = False
    std: Array | None = None


@dataclass(frozen=True, kw_only=True)
class Plot:
    """All that is drawn in one frame."""

    title: str
    x: Axis
    y: Axis
    curves: Sequence[PlotCurve]
    told: Sequence[tuple[str, str, str]] = ()
    """Further entries of the legend: text, colour, and a curve's kind or nothing."""
    unmeasured: Sequence[Range] = ()
    """Ranges of the horizontal axis that no data reach."""

    @classmethod
    def over(
        cls, title: str, x: str, y: str, curves: Sequence[PlotCurve], *, told: Sequence[tuple[str, str, str]] = (),
        log: str = "", margin: float = 0.06,
    ) -> Plot:  # fmt: skip
        """A plot whose axes hold its curves, a linear vertical one zero too.

        Parameters
        ----------
        x, y
            What the axes are called, with their units.
        log
            Which axes are logarithmic: ``x``, ``y`` or ``xy``.
        """
        heights = [curve.y for curve in curves] + ([] if "y" in log else [np.zeros(1)])
        across = Axis.over(x, [curve.x for curve in curves], log="x" in log, margin=margin)
        up = Axis.over(y, heights, log="y" in log, margin=margin)
        return cls(title=title, x=across, y=up, curves=curves, told=told)
