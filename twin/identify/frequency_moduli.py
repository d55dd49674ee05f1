"""Moduli of a structure from natural frequencies alone, with hardly anything assumed of them beforehand."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.arrays import Array
from twin.identify.base_fit import BaseFit, fit_base
from twin.identify.limits import LIMITS
from twin.identify.residuals.frequency_model import FrequencyModel, check_modes
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies, measured_frequencies
from twin.rigs import Rig


@dataclass(frozen=True, kw_only=True)
class FrequencyModuli:
    """What a table of natural frequencies says of a structure's moduli, N/m2."""

    evidence: MeasuredFrequencies
    fit: BaseFit
    warnings: tuple[str, ...]

    @property
    def model(self) -> Rig:
        """The rig file with the identified moduli."""
        return self.evidence.with_moduli(self.fit.baseline.base)

    @property
    def preload(self) -> str:
        """The state that was measured."""
        return self.evidence.tables[0].state

    @property
    def mode(self) -> NDArray[np.int64]:
        """Numbers of the modes, (m,)."""
        return self.evidence.tables[0].number

    @property
    def measured_Hz(self) -> Array:
        """Measured natural frequencies, (m,)."""
        return self.evidence.frequency_Hz

    @property
    def before_Hz(self) -> Array:
        """The nominal structure's, (m,)."""
        return FrequencyModel(self.evidence).frequencies(self.evidence.tables[0], self.evidence.nominal)

    @property
    def after_Hz(self) -> Array:
        """The identified structure's, (m,)."""
        return FrequencyModel(self.evidence).frequencies(self.evidence.tables[0], self.fit.baseline.base)

    @property
    def nominal(self) -> dict[str, float]:
        """Moduli as the rig file has them, by name."""
        return self.evidence.moduli(self.evidence.nominal)

    @property
    def moduli(self) -> dict[str, float]:
        """Identified, by name."""
        return self.evidence.moduli(self.fit.baseline.base)

    @property
    def moduli_std(self) -> dict[str, float]:
        """Their standard deviations."""
        deviation = np.sqrt(np.diag(self.covariance))
        return {name: value * float(s) for (name, value), s in zip(self.moduli.items(), deviation, strict=True)}

    @property
    def covariance(self) -> Array:
        """Of the moduli's logarithms, in the order of `moduli`."""
        places = list(self.evidence.where.values())
        return np.asarray(self.fit.solution.covariance[np.ix_(places, places)])

    @property
    def error_percent(self) -> Array:
        """Model over measured, minus one, in per cent (m,)."""
        return np.asarray(100 * (self.after_Hz / self.measured_Hz - 1))

    @property
    def residual_factor(self) -> float:
        """How many times worse than their own uncertainty the frequencies are met; NaN without degrees of freedom."""
        dof = len(self.mode) - len(self.nominal)
        return float(np.sqrt(self.fit.solution.chi2 / dof)) if dof > 0 else float("nan")

    def directions(self) -> list[tuple[float, dict[str, float]]]:
        """Combinations of the moduli's logarithms, the best determined first, each with its standard deviation."""
        variance, columns = np.linalg.eigh(self.covariance)
        found = []
        for value, column in zip(variance, columns.T, strict=True):
            column = column * np.sign(column[np.argmax(np.abs(column))])
            found.append((float(np.sqrt(value)), dict(zip(self.nominal, column.tolist(), strict=True))))
        return found


def moduli_data(table: FrequencyTable, rig: Rig, *, source: str, preload: str | None) -> MeasuredFrequencies:
    """The evidence of a table of one state from which moduli are identified; `source` names the rig in errors.

    InputError if the table has fewer than two frequencies, several preloads, or another one, or the rig has no modulus.
    """
    path, states = table.path, dict.fromkeys(table.preload)
    if len(table) < 2:
        raise InputError(path, "", "holds one natural frequency", "moduli need at least two")
    if len(states) > 1:
        raise InputError(path, "column preload", f"holds {', '.join(states)}", "identify each preload by itself")
    asked = [preload] if preload else []
    evidence = measured_frequencies([table], rig, preloads=asked, source=source, log_std=LIMITS.unknown_std)
    if not evidence.where:
        raise InputError(source, "", "has neither a joint nor a beam, whose moduli frequencies could give")
    check_modes(evidence)
    return evidence


def fit_moduli(evidence: MeasuredFrequencies) -> FrequencyModuli:
    """Fit the moduli to :func:`moduli_data`."""
    told = (
        ()
        if evidence.stated
        else (f"frequencies without std_Hz are taken to be good to {100 * LIMITS.assumed_std:g} %",)
    )
    return FrequencyModuli(
        evidence=evidence, fit=fit_base(evidence, tolerance=LIMITS.frequency_moduli_fine), warnings=told
    )
