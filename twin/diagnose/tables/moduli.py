"""E' and G' of a lap joint from natural frequencies alone, with hardly anything assumed of them beforehand."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.diagnose.tables.fit import Fit, Problem
from twin.diagnose.tables.frequencies import check_modes
from twin.diagnose.tables.lap_joint import LapJointFrequencies, require_one_joint
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.measured import Measurement
from twin.diagnose.tables.search import moduli_alone
from twin.rigs import Rig
from twin.rigs.preloads import known_preload

Array = NDArray[np.float64]
SHEAR_GRID = np.geomspace(1e6, 3e9, 40)
"""N/m2, from layers that hardly hold to those that frequencies cannot tell from rigid ones."""


@dataclass(frozen=True, kw_only=True)
class FrequencyModuli:
    """What a table of natural frequencies says of a joint.

    Attributes
    ----------
    model : Rig
        With the identified moduli.
    mode : ndarray of int, (m,)
    measured_Hz, before_Hz, after_Hz : ndarray, (m,)
        Measured, of the nominal rig, and of the identified one.
    nominal : dict
        Moduli as the rig file has them, N/m2, by their names in the fit.
    """

    preload: str
    model: Rig
    mode: NDArray[np.int64]
    measured_Hz: Array
    before_Hz: Array
    after_Hz: Array
    nominal: dict[str, float]
    fit: Fit
    warnings: tuple[str, ...]

    @property
    def error_percent(self) -> Array:
        """Model over measured, minus one, in per cent (m,)."""
        return np.asarray(100 * (self.after_Hz / self.measured_Hz - 1))

    @property
    def residual_factor(self) -> float:
        """How many times worse than their own uncertainty the frequencies are met; NaN without degrees of freedom."""
        dof = len(self.mode) - len(self.nominal)
        return float(np.sqrt(self.fit.chi2 / dof)) if dof > 0 else float("nan")

    def directions(self) -> list[tuple[float, dict[str, float]]]:
        """Combinations of the moduli's logarithms, the best determined first, each with its standard deviation."""
        variance, columns = np.linalg.eigh(self.fit.covariance)
        found = []
        for value, column in zip(variance, columns.T, strict=True):
            column = column * np.sign(column[np.argmax(np.abs(column))])
            found.append((float(np.sqrt(value)), dict(zip(self.nominal, column.tolist(), strict=True))))
        return found


def fit_moduli(table: FrequencyTable, rig: Rig, *, source: str, preload: str | None) -> FrequencyModuli:
    """Fit E' and G' to a table of one preload; `source` names the rig in errors.

    Raises
    ------
    InputError
        If the rig has not one joint, or the table fewer than two frequencies, several preloads, or another one.
    """
    path = table.path
    require_one_joint(rig, source=source)
    if len(table) < 2:
        raise InputError(path, "", "holds one natural frequency", "E' and G' need at least two")
    if len(states := dict.fromkeys(table.preload)) > 1:
        raise InputError(path, "column preload", f"holds {', '.join(states)}", "identify each preload by itself")
    if (state := table.preload[0]) and preload not in (None, state):
        raise InputError("--preload", "", f"is {preload}, {path} holds {state}")
    name = known_preload(rig, preload or state or None)
    model = LapJointFrequencies(rig, (name,), source, moduli_std=LIMITS.unknown_std)
    told = np.isfinite(table.std_Hz) & (table.std_Hz > 0)
    relative_std = np.where(told, table.std_Hz / table.frequency_Hz, LIMITS.assumed_std)
    measured = Measurement(path, name, table.mode, table.frequency_Hz, relative_std, stated=True)
    problem = Problem(model, (measured,))
    check_modes(problem)
    fit = _searched(problem, moduli_alone(problem))
    nominal = {b.name: b.nominal for b in model.base}
    return FrequencyModuli(
        preload=name,
        model=model.with_moduli(fit.moduli),
        mode=table.mode,
        measured_Hz=table.frequency_Hz,
        before_Hz=problem.frequencies(replace(fit, moduli=nominal), {name: table.mode})[name],
        after_Hz=fit.frequency_Hz[name],
        nominal=nominal,
        fit=fit,
        warnings=tuple(_warnings(model, bool(told.all()))),
    )


def _searched(problem: Problem, best: Fit) -> Fit:
    """The best fit from a grid of both moduli.

    An axial mode veers through the bending modes as G' grows, and each crossing makes a narrow minimum of its own.
    """
    (item,) = problem.measured
    normal, shear = best.moduli
    for _ in range(LIMITS.moduli_rescans):
        starts = [{normal: best.moduli[normal] * e, shear: float(G)} for G in SHEAR_GRID for e in (0.7, 1.0, 1.4)]
        models = [problem.frequencies(replace(best, moduli=m), {item.condition: item.number}) for m in starts]
        misfit = [np.sum((np.log(f[item.condition] / item.frequency_Hz) / item.relative_std) ** 2) for f in models]
        fits = [
            problem.fit((), start=starts[k], iterations=60, tolerance=LIMITS.search_fine)
            for k in np.argsort(misfit)[: LIMITS.moduli_followed]
        ]
        better = min(fits, key=lambda fit: fit.chi2)
        if better.chi2 >= best.chi2:
            break
        best = better
    return best


def _warnings(model: LapJointFrequencies, told: bool) -> Sequence[str]:
    acting = {change.cause for change in model.changes}
    found = [
        f"the effect {effect.cause} does not act on natural frequencies here"
        for effect in model.rig.effect
        if effect.cause not in acting
    ]
    if not told:
        found.append(f"frequencies without std_Hz are taken to be good to {100 * LIMITS.assumed_std:g} %")
    return found
