"""A run of one resonance, and a small diagnosis whose truth is an added mass, both without a bench or a search."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from recordings import Run
from studies.force_levels import with_polynomials
from twin.diagnose.answer.comparison import compare_sweeps, predicted_steps
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.gain import Gain, HeldOutError
from twin.diagnose.answer.result import Diagnosis, Estimate, Misfit, NamedCause
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.models import CAUSES
from twin.diagnose.selection.search import Search
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.identified import identify_rig
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import HARMONICS, MeasuredData, StepArrays
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.spectra.broadband import BinnedResponse
from twin.identify.spectra.sine_fit import SteadyState
from twin.lab.identified_joint import IdentifiedJoint
from twin.rigs import load_rig, preload_name
from twin.views.curves import broadband_responses

sys.path.insert(0, str(Path(__file__).parent))  # the helpers beside this file

from recorded_views import fitted_model, sdof_run

NOISE = 1e-3


@pytest.fixture(scope="session")
def run() -> Run:
    return sdof_run()


@pytest.fixture(scope="session")
def unmeasured(run: Run, make_state: Callable[..., SteadyState]) -> tuple[MeasuredData, BaselineParameters]:
    """A broadband run and two sweeps whose responses are still to be filled in, and what is true of the rig."""
    rig = load_rig("steel-lap-joint")
    outputs = tuple(Output(channel, "acceleration", rig.place_of(channel)) for channel in ("acc1", "acc2"))
    preload = preload_name(rig)
    model = build_linear_model(rig, list(outputs), preload=preload)
    law = LayerLaw(
        np.geomspace(1e-7, 1e-5, 4), np.geomspace(5e-8, 5e-6, 4),
        1e7 * np.array([0.1, 0.5, 2.0, 6.0]), 1e7 * np.array([0.1, 0.6, 3.0, 9.0]),
    )  # fmt: skip
    baseline = BaselineParameters(nominal_parameters(rig, preload), (law,))
    frequency = np.tile(np.linspace(25.0, 27.5, 21), 2)
    level = np.repeat([1.5, 3.0], 21)
    shape = (len(frequency), 2, HARMONICS)
    force = np.zeros((len(frequency), HARMONICS), complex)
    force[:, 0] = level
    steps = StepArrays(
        omega=2 * np.pi * frequency, force=force, force_variance=np.full(force.shape, 1e-10),
        response=np.ones(shape, complex), response_variance=np.full(shape, 1e-10),
        amplitude_m=np.geomspace(1e-4, 3e-3, len(frequency)), time_s=np.arange(len(frequency), dtype=float),
        growth=np.zeros(len(frequency)), growth_std=np.full(len(frequency), 1e-6),
        states=tuple(
            make_state(sweep=f"{a:g}N-up", index=i, frequency_Hz=f, time_s=float(i))
            for i, (a, f) in enumerate(zip(level, frequency, strict=True))
        ),
    )  # fmt: skip
    bins = np.linspace(20.0, 500.0, 60)
    covariance = np.tile(NOISE**2 * np.eye(2), (len(bins), 1, 1))
    binned = BinnedResponse(
        run="random.mcap", time_s=0.0, frequency_Hz=bins, H=np.ones((len(bins), 2), complex),
        relative_covariance=covariance, channels=("acc1", "acc2"), noise_density={}, distortion=np.ones(len(bins)),
        force_power=np.zeros(len(bins)),
    )  # fmt: skip
    channels = {**run.channels, "acc2": replace(run.channels["acc1"], name="acc2", position_m=0.42)}
    evidence = MeasuredData(
        rig=rig, preload=preload, model=model, outputs=outputs, force="force", reference=1, broadband=(binned,),
        steps=steps, unsettled=(), linear=None, runs=(replace(run, channels=channels),),
    )  # fmt: skip
    return evidence, baseline


def _measured(evidence: MeasuredData, truth: FittedModel) -> MeasuredData:
    """The evidence with what `truth` predicts as responses, the sweeps with noise.

    The reference channel moves as far as its level would move it were the joint linear; the force is what that takes.
    """
    steps, at = evidence.steps, evidence.reference
    law = truth.baseline.laws[0]
    linear = replace(
        truth, baseline=BaselineParameters(truth.baseline.base, (LayerLaw.zero(law.opening_knots, law.slip_knots),))
    )  # fmt: skip
    response, force = np.zeros_like(steps.response), np.zeros_like(steps.force)
    response[:, at, 0] = predicted_steps(evidence, linear)[:, at] * steps.force[:, 0]
    moved = replace(evidence, steps=replace(steps, response=response))
    H = predicted_steps(moved, truth)
    force[:, 0] = response[:, at, 0] / H[:, at]
    noise = np.random.default_rng(3).normal(size=H.shape)
    response = response.copy()
    response[:, :, 0] = H * force[:, :1] * (1 + 0.3 * NOISE * noise)
    amplitude_m = np.abs(response[:, at, 0]) / steps.omega**2
    variance = np.repeat((NOISE * np.abs(response[:, :, :1])) ** 2, HARMONICS, axis=2)
    steps = replace(steps, response=response, response_variance=variance, force=force, amplitude_m=amplitude_m)
    evidence = replace(evidence, steps=steps)
    (binned,) = evidence.broadband
    return replace(evidence, broadband=(replace(binned, H=broadband_responses(evidence, truth, 0)),))


@pytest.fixture(scope="session")
def identified(unmeasured: tuple[MeasuredData, BaselineParameters]) -> IdentifiedJoint:
    """What is found of a rig whose file is right, from what it would measure."""
    blank, baseline = unmeasured
    evidence = _measured(blank, fitted_model(baseline, (), (100.0,)))
    found = with_polynomials(identify_rig(evidence), evidence)
    return IdentifiedJoint(found=found, evidence=evidence, warnings=found.warnings)


@pytest.fixture(scope="session")
def diagnosis(unmeasured: tuple[MeasuredData, BaselineParameters]) -> Diagnosis:
    evidence, baseline = unmeasured
    values = {"mass_kg": 0.008, "position_m": 0.35}
    std = {"mass_kg": 8e-6, "position_m": 5e-5}
    hypothesis = CauseHypothesis(CAUSES["added-mass"], {}, values, std)
    base = fitted_model(baseline, (), (900.0, 400.0, 390.0))
    true = fitted_model(baseline, (hypothesis,), (390.0, 120.0, 100.0))
    assert modification_of(evidence, (hypothesis,)).attachments
    evidence = _measured(evidence, true)
    sweeps = compare_sweeps(evidence, base, true)
    return Diagnosis(
        verdict="explained",
        misfit=Misfit(
            chi2_per_dof=142.0, after=0.93, threshold=1.4,
            where=({"run": "sweeps.mcap", "channel": "acc2", "harmonic": 1, "share": 0.7},),
        ),
        causes=(
            NamedCause(
                cause="added-mass", summary="a mass <b>sits</b> on the structure", probability=0.98,
                confused_with=("sensor-position",), in_model=True,
                parameters={name: Estimate(values[name], std[name]) for name in values},
            ),
        ),
        gain=Gain(
            0.054,
            0.0077,
            0.005,
            expected=0.006,
            in_deviations=(9.0, 1.3),
            by_harmonic={1: HeldOutError(0.054, 0.0077, 0.005, count=82)},
            runs=("heldout.mcap",),
            sweeps=("3N-up",),
        ),
        next_test=None,
        seconds=21.0,
        evidence=evidence,
        search=Search(base, true, (), evidence, None, None),
        sweeps=sweeps,
        held_out=sweeps[1:],
        notes=("2 step(s) were still changing and were left out",),
        set_95=("added-mass", "sensor-position"),
        excluded=(
            Exclusion("drive-mass", "mass_kg", 2.34e-5, {}),
            Exclusion("viscous-damper", "damping_Ns_per_m", 0.0071, {"part": "upper", "position_m": 0.42}),
            Exclusion("base-motion", "receptance_m_per_N", None, {}),
        ),
    )  # fmt: skip


@pytest.fixture(scope="session")
def rehearsal() -> dict[str, Any]:
    phasor = {"amplitude": 1.5, "phase_rad": 0.0, "std": 1e-4}
    steps = [
        {
            "sweep": "1.5N-up", "index": i, "frequency_Hz": 25.0 + i, "target_channel": "force",
            "target_amplitude": 1.5, "settle_s": 5.0, "measure_s": 2.0,
            "amplitude_error": -0.002, "transient": None if i == 0 else 0.0004,
            "distortion": {"force": 0.0021, "acc1": 0.008}, "limit_use": {"voltage": 0.31},
            "range_use": {"force": 0.03, "acc1": 0.2 + i / 10},
            "phasors": {"force": phasor, "acc1": {"amplitude": 3.0 + i, "phase_rad": 1.0, "std": None}},
        }
        for i in range(4)
    ]  # fmt: skip
    caution = {
        "kind": "dwell-too-short", "severity": "warning", "sweep": "1.5N-up", "index": 2, "frequency_Hz": 27.0,
        "steps": 3, "reason": "0.2 s against a time constant of 2.6 s", "advice": "settle for 12 s", "changes": {},
    }  # fmt: skip
    summary = {
        "sweep": "1.5N-up", "steps": 4, "duration_s": 28.0, "response_channel": "acc1", "peak_frequency_Hz": 28.0,
        "peak_response": 6.0, "quality_factor": None,
    }  # fmt: skip
    return {
        "state": "done", "reason": "", "clear": False, "must_not_run": False, "duration_s": 28.0,
        "warnings": [caution], "sweeps": [summary], "steps": steps, "branches": [], "improved": None,
        "procedure": "steel-sweeps", "rig": "steel-lap-joint", "preload": "120N",
    }  # fmt: skip
