"""From evidence to a model file: the rig with identified moduli, damping and joint law."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.identify.base_fit import fit_base
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.estimate import Estimate
from twin.identify.gauss_newton import Solution
from twin.identify.limits import LIMITS
from twin.identify.linear.mesh_error import mesh_errors
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import Polynomials
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.rms import relative_error_percent
from twin.identify.updated_rig import updated_rig
from twin.rigs import Rig


@dataclass(frozen=True, kw_only=True)
class Identified:
    """What recordings say of a rig."""

    rig: Rig
    """The model: the nominal rig with what was identified, at the identified preload only."""
    preload: str
    linear: dict[str, Estimate | list[Estimate]]
    """E', G', their loss factors and the modal damping ratios; a list where there are several, of one for each joint or
    mode.  The values are the model's; the standard deviations allow for natural frequencies that are a little wrong by
    themselves, which a rig file has no place for, and for what the mesh makes of the moduli."""
    baseline: BaselineParameters
    """Of the model."""
    solution: Solution
    chi2_per_dof: float
    residual_percent: dict[str, float]
    """Root-mean-square relative error of the model's complex response at the reference channel, by sweep."""
    warnings: tuple[str, ...]
    polynomials: Polynomials | None = None
    """None without sweeps, and of a rig that has not one joint: a function of one sensor's amplitude is one joint's."""


def identify_rig(evidence: MeasuredData, *, report: Callable[[str], None] = lambda text: None) -> Identified:
    """Identify moduli, damping and the joint's law.

    Parameters
    ----------
    report
        Told what is being done.
    """
    report("fitting moduli, damping and the joint's law")
    free = fit_base(evidence)
    held = _held(free.baseline)
    identified = fit_base(evidence, start=free.baseline, held_at_zero=held)
    model, solution = identified.baseline, identified.solution
    dof = max(1, len(solution.residual) - len(solution.x) + len(held))
    residual = _spline_residuals(ResidualModel(evidence), model) if len(evidence.steps) else {}
    return Identified(
        rig=updated_rig(evidence, model, solution),
        preload=evidence.preload,
        linear=linear_estimates(free.baseline, free.solution, model, evidence),
        baseline=model,
        solution=solution,
        chi2_per_dof=solution.chi2 / dof,
        residual_percent=residual,
        warnings=tuple(_warnings(evidence, solution.chi2 / dof)),
    )


def _held(baseline: BaselineParameters) -> list[int]:
    """Parameters that a rig file has no place for: they cost a few hundredths of a per cent of the response."""
    every = np.arange(len(baseline.blocks))
    return [int(i) for name in ("loss_E", "frequency_discrepancy") for i in every[baseline.blocks[name]]]


def linear_estimates(
    free: BaselineParameters, solution: Solution, model: BaselineParameters, evidence: MeasuredData
) -> dict[str, Estimate | list[Estimate]]:
    """What a `model` has of the linear parameters, with the standard deviations of a fit where more of them are `free`.

    As :attr:`Identified.linear`.  The `evidence` tells whose mesh they are of.
    """
    std = free.blocks.unpack(np.sqrt(np.maximum(np.diag(solution.covariance), 0.0)))
    base = model.base
    of_mesh_E, of_mesh_G = mesh_errors(evidence.model.structure, evidence.rig, base.E, base.G)
    linear: dict[str, Estimate | list[Estimate]] = {}
    for name, values, errors in (
        ("normal_modulus", base.E, base.E * np.hypot(std["log_E"], of_mesh_E)),
        ("shear_modulus", base.G, base.G * np.hypot(std["log_G"], of_mesh_G)),
        ("normal_loss_factor", free.base.loss_E, std["loss_E"]),
        ("shear_loss_factor", free.base.loss_G, std["loss_G"]),
    ):
        each = [Estimate(float(value), float(error)) for value, error in zip(values, errors, strict=True)]
        linear[name] = each[0] if len(each) == 1 else each
    modes = zip(base.zeta, base.zeta * std["log_zeta"], strict=True)
    linear["modal_damping"] = [Estimate(float(zeta), float(error)) for zeta, error in modes]
    return linear


def _spline_residuals(residual_model: ResidualModel, model: BaselineParameters) -> dict[str, float]:
    evidence = residual_model.evidence
    R, omega, _ = residual_model.step_receptance(model, inner=False)
    H = residual_model.responses(R, omega)[:, evidence.reference]
    measured = evidence.steps.response[:, evidence.reference, 0] / evidence.steps.force[:, 0]
    return {name: relative_error_percent(H[rows], measured[rows]) for name, rows in evidence.steps.by_sweep.items()}


def _warnings(evidence: MeasuredData, chi2_per_dof: float) -> list[str]:
    found = []
    if not evidence.broadband:
        found.append("no broadband run: E', G' and the higher modes' damping rest on what is assumed of them")
    if not len(evidence.steps):
        found.append("no sweeps: the model's joint law is a constant loss")
    if evidence.unsettled:
        where = ", ".join(f"{s.sweep} at {s.frequency_Hz:g} Hz" for s in evidence.unsettled[:3])
        found.append(f"{len(evidence.unsettled)} step(s) left out that were still changing: {where}")
    found += evidence.unused_told
    lost = sum(state.lost for state in evidence.steps.states)
    overloaded = sum(state.overloaded for state in evidence.steps.states)
    if lost or overloaded:
        found.append(f"{lost} samples lost and {overloaded} on a converter's limit within the measured steps")
    if chi2_per_dof > LIMITS.poor_fit:
        found.append(
            f"chi2 per degree of freedom is {chi2_per_dof:.2f}: the model misses something, see 'twin diagnose'"
        )
    return found
