"""The 2011 paper's lap joint: E', G' at both preloads, and what removes the error of mode 3."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.sparse import csr_array

from studies.eigensensitivity import FrequencyUpdate, Parameter
from studies.identifiability import profile_likelihood
from studies.lap_joint_moduli import SharedEffect, lap_joint_problem, point_mass_effect, update_moduli
from studies.membrane import interface_layer, membrane_layer, with_layer_element
from studies.reproduction import Reproduction, TriedModel, compared, describe_update
from studies.shear_change import shear_change
from studies.tables import load_study
from twin.rigs import LapJointRig, Rig, load_rig
from twin.structure import Structure, assemble

RELATIVE_STD = 1e-3
"""Assumed of every printed frequency: bolted joints repeat to about 0.1 %, ten times the print's rounding."""

LIGHT_SENSOR_KG = 0.002
"""Mass of an ordinary miniature accelerometer, assumed of both before the data are asked."""


@dataclass(frozen=True)
class SteelUpdate:
    """An update of the steel joint with one shared cause freed: the cause, its parameters in SI, and the update."""

    cause: str
    parameters: dict[str, dict[str, float]]
    update: FrequencyUpdate


def nominal_rig() -> LapJointRig:
    """The shipped rig with two light accelerometers instead of the inferred masses."""
    rig = load_rig("steel-lap-joint")
    assert isinstance(rig, LapJointRig)
    sensors = [s if s.quantity == "force" else s.model_copy(update={"mass": LIGHT_SENSOR_KG}) for s in rig.sensor]
    return rig.model_copy(update={"sensor": sensors})


def reproduce_steel_lap_joint() -> Reproduction:
    """Table 1 of the paper beside this project's, with the causes that were tried."""
    study, rig = load_study("steel-lap-joint"), nominal_rig()
    structure, measured = assemble(rig), _measured(rig)
    base = update_moduli(rig, measured, relative_std=RELATIVE_STD, structure=structure)
    places = (rig.length, rig.length - rig.upper.length / 2, rig.drive.position)
    trials: list[Callable[[int], SteelUpdate]] = [partial(_mass, rig, structure, place) for place in places]
    trials += [partial(_modulus, rig, structure), partial(_clamp, rig), partial(_shear, rig, structure)]
    tried = [trial(0) for trial in trials]
    first = int(np.argmin([trial.update.chi2 for trial in tried]))
    best = tried[first] = trials[first](2)

    tip = rig.layout().position(rig.place_of(rig.response_sensors[-1].channel))
    assert tip is not None
    effect = point_mass_effect(structure, tip, name="added_mass", start_kg=0.01)
    profiles, four = [], {}
    if first == 0:
        problem = lap_joint_problem(rig, measured, relative_std=RELATIVE_STD, structure=structure, effects=[effect])
        profiles = [profile_likelihood(*problem, best.update, name) for name in best.update.names]
        for preload, frequencies in measured.items():
            alone = update_moduli(
                rig, {preload: frequencies}, relative_std=RELATIVE_STD, structure=structure, effects=[effect], rescans=0
            )
            four[preload] = describe_update(alone, [])
    update = best.update
    return Reproduction(
        **compared(study, list(study.condition), update, moduli_only=base),
        free_parameters=len(update.names),
        parameters={n: {"value": update.values[n], "std": update.std[n]} for n in update.names},
        published_parameters={
            f"{key}[{n}]": value for n, c in study.condition.items() for key, value in c.published.items()
        },
        causes=[{"cause": best.cause, "parameters": best.parameters}],
        candidates=[_tried_model("none", {}, base)] + [_tried_model(t.cause, t.parameters, t.update) for t in tried],
        identifiability=describe_update(update, profiles),
        assumed_std_percent=100 * RELATIVE_STD,
        notes=list(study.note),
        details={
            "four_frequencies_of_one_preload": four,
            "element_choice": _elements(rig, structure),
            "nominal_sensor_mass_kg": LIGHT_SENSOR_KG,
            "gain_rms_percent": {"before": base.rms_percent, "after": update.rms_percent},
        },
    )


def _elements(rig: Rig, structure: Structure) -> dict[str, dict[str, object]]:
    """The same update, tip mass free, with each of the elements that the layer may have: E', G' like with like."""
    layers = {
        "exact-kinematics": structure,
        "membrane with drilling rotations": with_layer_element(structure, membrane_layer),
        "zero-thickness interface": with_layer_element(structure, interface_layer),
    }
    result: dict[str, dict[str, object]] = {}
    for name, layered in layers.items():
        effect = point_mass_effect(layered, rig.layout().length, name="added_mass", start_kg=0.01)
        update, _, _ = _fit(rig, layered, effect, 0)
        result[name] = {
            "parameters": {n: {"value": update.values[n], "std": update.std[n]} for n in update.names},
            "chi2": update.chi2,
            "worst_percent": update.worst_percent,
        }
    return result


def _measured(rig: Rig) -> dict[str, list[float]]:
    return {preload: table.natural_frequencies for preload, table in rig.measured.items()}


def _tried_model(cause: str, parameters: dict[str, dict[str, float]], update: FrequencyUpdate) -> TriedModel:
    return TriedModel.of(cause, parameters, update, len(update.names), update.bic)


def _fit(rig: Rig, structure: Structure, effect: SharedEffect, rescans: int) -> tuple[FrequencyUpdate, float, float]:
    update = update_moduli(
        rig, _measured(rig), relative_std=RELATIVE_STD, structure=structure, effects=[effect], rescans=rescans
    )
    name = effect.parameter.name
    return update, update.values[name], update.std[name]


def _mass(rig: Rig, structure: Structure, position_m: float, rescans: int) -> SteelUpdate:
    effect = point_mass_effect(structure, position_m, name="added_mass", start_kg=0.01)
    update, value, std = _fit(rig, structure, effect, rescans)
    parameters = {"position_m": {"value": position_m, "std": 0.0}, "mass_kg": {"value": value, "std": std}}
    return SteelUpdate("added-mass", parameters, update)


def _modulus(rig: Rig, structure: Structure, rescans: int) -> SteelUpdate:
    K0, zero = structure.K0, np.zeros_like(structure.K0)
    effect = SharedEffect(
        Parameter("modulus_factor", 0.95, lower=0.1, upper=10.0), lambda factor: (zero, (factor - 1) * K0, zero, K0)
    )
    update, value, std = _fit(rig, structure, effect, rescans)
    return SteelUpdate("beam-modulus", {"factor": {"value": value, "std": std}}, update)


def _clamp(rig: Rig, rescans: int) -> SteelUpdate:
    """The clamp turns: its rotation becomes a coordinate with a spring."""
    one, two = (assemble(rig, layout=rig.layout().with_yielding_supports(1 / k)) for k in (1.0, 2.0))
    spring = two.K0 - one.K0
    structure, zero = replace(one, sparse_K0=one.sparse_K0 - csr_array(spring)), np.zeros_like(spring)
    effect = SharedEffect(
        Parameter("rotational_stiffness", 1e4, lower=1.0, upper=1e12), lambda k: (zero, k * spring, zero, spring)
    )
    update, value, std = _fit(rig, structure, effect, rescans)
    parameters = {"rotational_rad_per_Nm": {"value": 1 / value, "std": std / value**2}}
    return SteelUpdate("clamp-compliance", parameters, update)


def _shear(rig: Rig, structure: Structure, rescans: int) -> SteelUpdate:
    effect = SharedEffect(
        Parameter("shear_ratio", 3.1, lower=1e-3, upper=1e4), lambda ratio: shear_change(structure, ratio)
    )
    update, value, std = _fit(rig, structure, effect, rescans)
    return SteelUpdate("transverse-shear", {"modulus_ratio": {"value": value, "std": std}}, update)
