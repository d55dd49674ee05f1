"""The papers' nonlinear sweeps: made by the bench from a law of the papers' form, and identified as any recording is.

The bench marches the law in time, through shaker, sensors, their noise and a 24-bit converter; the identification sees
the recordings and the rig file alone.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from recordings import RunWriter, read_run
from recordings.beside import temporary_folder
from studies.force_levels import with_polynomials
from studies.reproduction import NonlinearSweeps
from studies.tables import Law, Study, Sweeps
from twin.bench import open_bench
from twin.demo import broadband, planned_sweeps, resonance
from twin.demo.plan import BROADBAND, SWEEPS
from twin.diagnose.effects import with_effects
from twin.identify.identified import identify_rig
from twin.identify.measured_data import MeasuredData, gather_data
from twin.identify.polynomials import Polynomials
from twin.procedures import DirectAcquisition, Procedure, run_procedure
from twin.rigs import LawTable, Rig, moduli_at, preload_record

LAW_KNOTS = 160
HEADROOM = 0.98
"""Share of a sensor's range that the guards leave."""


def reproduce_sweeps(
    study: Study, rig: Rig, *, seed: int, report: Callable[[str], None] = lambda text: None
) -> NonlinearSweeps:
    """Record and identify all preloads of a study.

    Parameters
    ----------
    study
        With sweeps.
    rig
        What the experimenter believes; the bench adds the law.
    seed
        Of the sensors' noise.
    report
        Told what is being done.
    """
    assert study.sweeps is not None
    residual: dict[str, dict[str, float]] = {}
    details: dict[str, Any] = {}
    for number, (preload, law) in enumerate(study.sweeps.law.items()):
        report(f"{study.name}, {preload}: recording sweeps")
        evidence = record_sweeps(study.sweeps, rig, preload, seed=seed + 10 * number)
        report(f"{study.name}, {preload}: identifying the joint's law")
        evidence = with_effects(evidence, source=study.name)
        found = with_polynomials(identify_rig(evidence), evidence)
        assert found.polynomials is not None
        residual |= _residuals(study.sweeps, preload, found.polynomials)
        details[preload] = _details(found.polynomials, rig, preload, law)
    return NonlinearSweeps(residual, details, list(study.sweeps.note))


def rig_with_law(rig: Rig, sweeps: Sweeps, preload: str) -> Rig:
    """The rig with the study's law of one preload in its file."""
    X, law = np.linspace(0.0, sweeps.largest_amplitude_m, LAW_KNOTS), sweeps.law[preload]
    g1, g2 = (np.polynomial.polynomial.polyval(X, np.array(c)) for c in (law.softening, law.loss))
    table = LawTable(channel=sweeps.channel, amplitude_m=X.tolist(), softening=g1.tolist(), loss=g2.tolist())
    return rig.with_joints([rig.joints[0].model_copy(update={"law": table})])


def record_sweeps(sweeps: Sweeps, rig: Rig, preload: str, *, seed: int) -> MeasuredData:
    """A broadband run and the sweeps about the resonance that it shows, recorded to MCAP, read back and reduced."""
    true = rig_with_law(rig, sweeps, preload)
    with temporary_folder("twin-papers") as temporary:
        folder = temporary

        def record(name: str, procedure: Procedure, seed: int) -> None:
            bench = open_bench(true, preload=preload, seed=seed, sample_rate_Hz=procedure.sample_rate)
            acquisition = DirectAcquisition(bench)
            info = {"source": "simulated", "rig": rig.name, "procedure": procedure.procedure}
            info |= {"stored": procedure.store} | preload_record(preload)
            with RunWriter(folder / name, info=info, channels=acquisition.channels) as writer:
                result = run_procedure(procedure, acquisition, writer)
            if result.state != "done":
                raise RuntimeError(f"{rig.name}, {preload}: the bench ended its run: {result.reason}")

        record(BROADBAND, broadband(), seed)
        noise = read_run(folder / BROADBAND)
        planned = planned_sweeps(rig, resonance(noise, rig))[SWEEPS]
        guards = {sensor.channel: HEADROOM * sensor.range for sensor in rig.sensor}
        limits = planned.limits.model_copy(update={"peak": guards})
        record(SWEEPS, planned.model_copy(update={"amplitudes": sweeps.forces_N, "limits": limits}), seed + 1)
        return gather_data([noise, read_run(folder / SWEEPS)], rig, preload=preload)


def _residuals(sweeps: Sweeps, preload: str, found: Polynomials) -> dict[str, dict[str, float]]:
    """By preload and force, per cent: this force's own polynomials, those of all forces, and those of the others."""
    rows = {}
    for (_, residual), force in zip(found.residual_percent.items(), sweeps.forces_N, strict=True):
        name = f"{preload}, {force:g} N"
        left_out = found.left_out[f"force {force:g}"]
        rows[name] = {
            "this_model": residual["level"],
            "one_law_for_all_forces": residual["together"],
            "left_out_at_force": left_out.at_force_percent,
            "left_out_at_amplitude": left_out.at_amplitude_percent,
        }
        if name in sweeps.published_residual_percent:
            rows[name]["published"] = sweeps.published_residual_percent[name]
    return rows


def _details(polynomials: Polynomials, rig: Rig, preload: str, law: Law) -> dict[str, Any]:
    fit = polynomials.together
    X = np.linspace(0.05, 1.0, 96) * fit.largest_amplitude_m
    true = moduli_at(rig, preload)[0].normal_modulus - np.polynomial.polynomial.polyval(X, np.array(law.softening))
    E = float(polynomials.base.E[0]) * float(np.exp(fit.base_change[0]))
    softest = float(np.ptp(true))
    return {
        "orders_by_force": {name: list(one.orders) for name, one in polynomials.levels.items()},
        "orders": list(fit.orders),
        "softening": {"coefficients": fit.softening, "std": fit.std[0], "true": law.softening},
        "loss": {"coefficients": fit.loss, "std": fit.std[1], "true": law.loss},
        "largest_amplitude_m": fit.largest_amplitude_m,
        "modulus_error_percent": float(100 * np.sqrt(np.mean((E - fit.softening_at(X) - true) ** 2)) / softest),
        "regularisation": {"l_curve": fit.l_curve.corner, "cross_validated": fit.l_curve.cross_validated},
        "history": [{"cost": step.cost, "lambda": step.strength} for step in fit.history],
        "depends_on_force": polynomials.depends_on_force,
        "extrapolated": [name for name, one in polynomials.left_out.items() if one.extrapolated],
        "steps_lost": {name: one.lost for name, one in polynomials.left_out.items()},
    }
