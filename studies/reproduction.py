"""What a reproduced study reports: the printed numbers, this project's, and what was freed to get there."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from studies.eigensensitivity import FrequencyUpdate
from studies.identifiability import Profile, weak_directions
from studies.tables import Study, percent_error
from twin.identify.rms import rms


@dataclass(frozen=True)
class TriedModel:
    """A cause that was tried: what it adds, and the misfit it leaves."""

    cause: str
    parameters: dict[str, dict[str, float]]
    free_parameters: int
    chi2: float
    bic: float
    rms_percent: float
    worst_percent: float

    @classmethod
    def of(
        cls, cause: str, parameters: dict[str, dict[str, float]], update: FrequencyUpdate, free: int, bic: float
    ) -> Self:
        """With the misfit that an update leaves."""
        return cls(cause, parameters, free, update.chi2, bic, update.rms_percent, update.worst_percent)


@dataclass(frozen=True)
class Reproduction:
    """One study side by side: fields as ``twin reproduce --json`` prints them.

    Frequencies in Hz by condition; errors in percent of the measured value; `parameters` with standard deviations;
    `causes` the effects added to the model; `residual_percent` of nonlinear sweeps, where there are any.
    """

    source: str
    measured: dict[str, list[float]]
    published_model: dict[str, list[float]]
    this_model: dict[str, list[float]]
    error_percent: dict[str, dict[str, list[float]]]
    rms_percent: dict[str, float]
    free_parameters: int
    parameters: dict[str, dict[str, float]]
    published_parameters: dict[str, float]
    causes: list[dict[str, Any]]
    candidates: list[TriedModel]
    identifiability: dict[str, Any]
    assumed_std_percent: float
    notes: list[str] = field(default_factory=list)
    details: dict[str, Any] = field(default_factory=dict)
    residual_percent: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class NonlinearSweeps:
    """What the nonlinear sweeps gave: residuals in per cent by preload and force, what was identified, remarks."""

    residual_percent: dict[str, dict[str, float]]
    details: dict[str, Any]
    notes: list[str]

    def added_to(self, study: Reproduction) -> Reproduction:
        """The study with these results in it."""
        return replace(
            study,
            residual_percent=self.residual_percent,
            details={**study.details, "nonlinear": self.details},
            notes=[*study.notes, *self.notes],
        )


def compared(
    study: Study, conditions: Sequence[str], update: FrequencyUpdate, **others: FrequencyUpdate
) -> dict[str, Any]:
    """What every study tells of its frequencies: as measured, printed and found here, and the errors.

    Parameters
    ----------
    conditions
        Which of the study's.
    update
        The accepted model.
    others
        Further models, whose errors stand beside its own.
    """
    printed = {name: study.condition[name] for name in conditions}
    errors = {
        "published_model": {n: percent_error(c.measured, c.published_model) for n, c in printed.items()},
        "printed": {n: c.printed_error_percent for n, c in printed.items()},
        **{
            model: {n: e.tolist() for n, e in one.error_percent.items()}
            for model, one in {**others, "this_model": update}.items()
        },
    }
    return {
        "source": study.source,
        "measured": {n: c.measured for n, c in printed.items()},
        "published_model": {n: c.published_model for n, c in printed.items()},
        "this_model": {n: f.tolist() for n, f in update.after.items()},
        "error_percent": errors,
        "rms_percent": {model: rms(np.concatenate(list(e.values()))) for model, e in errors.items()},
    }


def describe_update(update: FrequencyUpdate, profiles: list[Profile]) -> dict[str, Any]:
    """Identifiability of an update in plain types: singular values, weak directions, profile intervals."""
    return {
        "singular_values": update.singular_values.tolist(),
        "directions": [
            {"singular_value": d.singular_value, "relative_std": d.relative_std, "combination": d.combination}
            for d in weak_directions(update)
        ],
        "profile_95": {p.name: [p.lower, p.upper] for p in profiles},
        "undetermined": [p.name for p in profiles if not p.determined],
        "chi2": update.chi2,
        "degrees_of_freedom": update.dof,
        "residual_factor": update.residual_factor,
        "iterations": len(update.history) - 1,
    }
