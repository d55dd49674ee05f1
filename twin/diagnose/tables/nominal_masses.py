"""Masses that a rig file states of its sensors, held against the frequencies: agreement may rest on them."""

from dataclasses import replace

from twin.diagnose.tables.fit import Fit, Problem
from twin.diagnose.tables.lap_joint import LapJointFrequencies
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.search import least_gain

HEAVY_KG = 0.005


def heavy_sensors(problem: Problem, base: Fit) -> list[str]:
    """Sensors of a lap joint whose stated mass the frequencies need, in words; `base` is the fit as stated."""
    model = problem.model
    if not isinstance(model, LapJointFrequencies):
        return []
    notes = []
    for sensor in model.rig.response_sensors:
        if sensor.mass <= HEAVY_KG:
            continue
        lighter = [
            other.model_copy(update={"mass": LIMITS.light_sensor_kg}) if other.channel == sensor.channel else other
            for other in model.rig.sensors
        ]
        nominal = replace(model, rig=model.rig.model_copy(update={"sensor": lighter}))
        rest = Problem(nominal, problem.measured)
        without = rest.fit((), iterations=40)
        if base.log_evidence - without.log_evidence < least_gain(problem, base):
            continue
        position = model.rig.position_of(sensor.channel)
        if position is None:
            continue
        mass = next(change for change in nominal.changes if change.cause == "added-mass")
        start = {"mass_kg": sensor.mass - LIMITS.light_sensor_kg, "position_m": position}
        asked = rest.fit(((mass, start),), held=frozenset(["position_m"]), iterations=25)
        value, std = asked.active[0][1]["mass_kg"], asked.std[0]["mass_kg"]
        notes.append(
            f"the agreement rests on the {1e3 * sensor.mass:.3g} g that the rig file states of {sensor.channel} at "
            f"{position:g} m: with {1e3 * LIMITS.light_sensor_kg:g} g in its place the frequencies are missed by "
            f"{100 * without.rms_error:.2g} % rms, and ask for an added mass of {1e3 * value:.1f} ± {1e3 * std:.1f} g "
            "there"
        )
    return notes
