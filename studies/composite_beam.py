"""The hybrid paper's composite beam, hung free: which cause bends its frequencies away from Euler and Bernoulli."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.eigensensitivity import FrequencySet, FrequencyUpdate, Parameter, Pencil, update_parameters
from studies.free_beam import FreeBeam, chained, free_beam
from studies.identifiability import profile_likelihood
from studies.reproduction import Reproduction, TriedModel, compared, describe_update
from studies.shear_derivatives import timoshenko_mass_derivative, timoshenko_stiffness_derivative
from studies.tables import Study, load_study

RELATIVE_STD = 1e-2
"""Weight of each frequency, about what the simplest adequate model leaves.

The noise of the hammer test is not stated, so evidence and standard deviations are taken from the residuals.
"""

SENSOR_PLACES = np.linspace(0.0, 0.5, 11)
"""Where along half of the beam an accelerometer may have sat, as fractions of its length."""

SHEAR_CORRECTION = 5.0 / 6.0
CONDITION = "free"


@dataclass(frozen=True)
class _Trial:
    """A set of causes: their contract names and free parameters beside the modulus, and the fit."""

    causes: tuple[str, ...]
    free: int
    sets: list[FrequencySet]
    parameters: list[Parameter]
    update: FrequencyUpdate
    position_m: float = 0.0

    @property
    def bic(self) -> float:
        """Bayesian information criterion with the noise itself unknown: n ln(mean square) + k ln n.

        It means nothing where as many parameters as frequencies are free; such a trial is shown and never chosen.
        """
        n = len(self.update.measured[CONDITION])
        return float(n * np.log(self.update.rms_percent**2) + self.free * np.log(n))


def composite_frequencies(
    study: Study, *, youngs_modulus: float, shear_ratio: float = 0.0, rotary: bool = False
) -> NDArray[np.float64]:
    """First four natural frequencies (Hz) of the free beam at its stated size and density."""
    from twin.structure import normal_modes

    beam = _beam(study, youngs_modulus=youngs_modulus, shear_ratio=shear_ratio, rotary=rotary)
    return normal_modes(beam.M, beam.K, 6).frequency_Hz[2:]


def reproduce_composite_beam() -> Reproduction:
    """Table 1 of the hybrid paper, its causes searched among shear, sensor mass and thickness, one or two at a time."""
    study = load_study("composite-beam")
    f = np.array(study.condition[CONDITION].measured)
    simple = _fit(study, f, (), _bernoulli(study), [])
    singles = [_shear(study, f), _sensor(study, f, with_shear=False), _thickness(study, f)]
    together = _sensor(study, f, with_shear=True)
    trials = [simple, *singles, together]
    best = min((trial for trial in trials if trial.free < len(f)), key=lambda trial: trial.bic)
    update, scale = best.update, best.update.residual_factor
    profiles = [profile_likelihood(best.sets, best.parameters, update, name) for name in update.names]
    ratio = update.values.get("shear_ratio")
    notes = list(study.note)
    notes.append(
        f"What remains, {update.rms_percent:.2f} % rms, goes down to {together.update.rms_percent:.2f} % with a sensor "
        f"of {1e3 * together.update.values['mass']:.1f} g at {together.position_m:.3f} m as well; that takes as many "
        "parameters as there are frequencies, so the data cannot confirm it."
    )
    return Reproduction(
        **compared(study, [CONDITION], update, euler_bernoulli=simple.update),
        free_parameters=len(update.names),
        parameters={n: {"value": update.values[n], "std": scale * update.std[n]} for n in update.names},
        published_parameters={"youngs_modulus": study.stated["youngs_modulus_table"]},
        causes=[{"cause": cause, "parameters": _cause_parameters(cause, best)} for cause in best.causes],
        candidates=[_tried_model(trial) for trial in trials],
        identifiability=describe_update(update, profiles),
        assumed_std_percent=100 * RELATIVE_STD * scale,
        notes=notes,
        details={
            "gain_rms_ratio": simple.update.rms_percent / update.rms_percent,
            "shear_modulus_Pa": None if ratio is None else update.values["youngs_modulus"] / ratio / SHEAR_CORRECTION,
            "modulus": _moduli(study, f, update),
        },
    )


def _moduli(study: Study, f: NDArray[np.float64], update: FrequencyUpdate) -> dict[str, object]:
    """What the stated size and density make of the measured and of the printed frequencies."""
    unit = composite_frequencies(study, youngs_modulus=1.0)
    here = update.values["youngs_modulus"]
    printed = {key: study.stated[f"youngs_modulus_{key}"] for key in ("before", "table", "text")}
    before = study.condition["free, before updating"].published_model
    after = study.condition[CONDITION].published_model
    return {
        "from_size_and_density_Pa": here,
        "euler_bernoulli_by_mode_Pa": ((f / unit) ** 2).tolist(),
        "printed_Pa": printed,
        "euler_bernoulli_mode_1_with_printed_Hz": {
            k: float(composite_frequencies(study, youngs_modulus=E)[0]) for k, E in printed.items()
        },
        "implied_by_printed_model_Pa": {
            "before": ((np.array(before) / unit) ** 2).tolist(),
            "table": ((np.array(after) / unit) ** 2).tolist(),
        },
        "density_needed_by_printed": {k: study.stated["density"] * E / here for k, E in printed.items()},
        "thickness_needed_by_printed_m": {
            k: study.stated["thickness"] * float(np.sqrt(here / E)) for k, E in printed.items()
        },
    }


def _beam(study: Study, **options: float | bool) -> FreeBeam:
    size = {key: study.stated[key] for key in ("length", "width", "thickness", "density")}
    return free_beam(**{**size, **options})  # type: ignore[arg-type]


def _bernoulli(study: Study) -> Callable[[Mapping[str, float]], Pencil]:
    beam = _beam(study, youngs_modulus=1.0, shear_ratio=0.0, rotary=False)

    def pencil(values: Mapping[str, float]) -> Pencil:
        return Pencil(beam.M, values["youngs_modulus"] * beam.K, beam.transverse, {}, {"youngs_modulus": beam.K})

    return pencil


def _timoshenko(study: Study) -> Callable[[Mapping[str, float]], Pencil]:
    def pencil(values: Mapping[str, float]) -> Pencil:
        E, ratio = values["youngs_modulus"], values["shear_ratio"]
        beam = _beam(study, youngs_modulus=E, shear_ratio=ratio)
        elements = len(beam.x) - 1
        area, radius2 = study.stated["width"] * study.stated["thickness"], study.stated["thickness"] ** 2 / 12
        element = {"radius2": radius2, "length": study.stated["length"] / elements, "shear_ratio": ratio}
        by_mass = timoshenko_mass_derivative(mass_per_length=study.stated["density"] * area, **element)
        by_stiffness = timoshenko_stiffness_derivative(EI=E * area * radius2, **element)
        dM, dK = (chained(part, elements) for part in (by_mass, by_stiffness))
        return Pencil(
            beam.M, beam.K, beam.transverse, {"shear_ratio": dM}, {"youngs_modulus": beam.K / E, "shear_ratio": dK}
        )

    return pencil


def _shear(study: Study, f: NDArray[np.float64]) -> _Trial:
    return _fit(study, f, ("transverse-shear",), _timoshenko(study), [Parameter("shear_ratio", 5.0, upper=1e3)])


def _sensor(study: Study, f: NDArray[np.float64], *, with_shear: bool) -> _Trial:
    """A sensor's mass at the best of several places, which count as one more free parameter."""
    bare = _timoshenko(study) if with_shear else _bernoulli(study)
    beam = _beam(study, youngs_modulus=1.0, shear_ratio=0.0)

    def at(place: float) -> _Trial:
        row = beam.row(place * study.stated["length"])
        unit = np.outer(row, row)

        def pencil(values: Mapping[str, float]) -> Pencil:
            p = bare(values)
            return Pencil(p.M + values["mass"] * unit, p.K, p.transverse, {**p.dM, "mass": unit}, p.dK)

        free = [Parameter("mass", 0.003, lower=1e-6, upper=0.05)]
        if with_shear:
            free.append(Parameter("shear_ratio", 5.0, upper=1e3))
        causes = ("transverse-shear", "added-mass") if with_shear else ("added-mass",)
        return _fit(study, f, causes, pencil, free, position_m=place * study.stated["length"])

    return min((at(place) for place in SENSOR_PLACES), key=lambda trial: trial.update.chi2)


def _thickness(study: Study, f: NDArray[np.float64]) -> _Trial:
    """The thickness within two per cent of the stated one, in bending stiffness, mass and rotary inertia."""
    stated = study.stated["thickness"]
    plain = _beam(study, youngs_modulus=1.0, shear_ratio=0.0, rotary=False)
    rotary = _beam(study, youngs_modulus=1.0, shear_ratio=0.0, rotary=True).M - plain.M

    def pencil(values: Mapping[str, float]) -> Pencil:
        E, h = values["youngs_modulus"], values["thickness"]
        r = h / stated
        M, dM = r * plain.M + r**3 * rotary, plain.M / stated + 3 * r**2 / stated * rotary
        dK = {"youngs_modulus": r**3 * plain.K, "thickness": E * 3 * r**2 / stated * plain.K}
        return Pencil(M, E * r**3 * plain.K, plain.transverse, {"thickness": dM}, dK)

    return _fit(study, f, ("thickness",), pencil, [Parameter("thickness", stated, prior_log_std=0.02)])


def _fit(
    study: Study,
    f: NDArray[np.float64],
    causes: tuple[str, ...],
    pencil: Callable[[Mapping[str, float]], Pencil],
    free: list[Parameter],
    *,
    position_m: float = 0.0,
) -> _Trial:
    parameters = [Parameter("youngs_modulus", study.stated["youngs_modulus_before"], lower=1e8, upper=1e12), *free]
    sets = [FrequencySet(CONDITION, f, RELATIVE_STD * f, pencil)]
    update = update_parameters(sets, parameters)
    return _Trial(causes, len(parameters) + ("added-mass" in causes), sets, parameters, update, position_m)


def _cause_parameters(cause: str, trial: _Trial) -> dict[str, dict[str, float] | str]:
    values, std, scale = trial.update.values, trial.update.std, trial.update.residual_factor

    def entry(name: str) -> dict[str, float]:
        return {"value": values[name], "std": scale * std[name]}

    if cause == "transverse-shear":
        return {"beam": "composite-beam", "modulus_ratio": entry("shear_ratio")}
    if cause == "added-mass":
        return {"position_m": {"value": trial.position_m}, "mass_kg": entry("mass")}
    return {cause: entry(cause)}


def _tried_model(trial: _Trial) -> TriedModel:
    parameters = {
        name: {"value": trial.update.values[name], "std": trial.update.std[name]} for name in trial.update.names[1:]
    }
    if "added-mass" in trial.causes:
        parameters["position_m"] = {"value": trial.position_m, "std": float("nan")}
    return TriedModel.of(" + ".join(trial.causes) or "none", parameters, trial.update, trial.free, trial.bic)
