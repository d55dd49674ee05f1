"""The steel rig's evidence put together by hand, and the rig itself as dense matrices that a test may change."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from beam_rows import deflection
from scipy.linalg import eigh

from recordings.run import Run, Step, StepState
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import HARMONICS, MeasuredData, StepArrays
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.spectra.broadband import BinnedResponse
from twin.rigs import load_rig
from twin.structure import Structure, assemble

RIG = load_rig("steel-lap-joint")
OUTPUTS = (
    Output("acc1", "acceleration", RIG.layout().place(0.30)),
    Output("acc2", "acceleration", RIG.layout().place(0.42)),
    Output("vel", "velocity", RIG.layout().place(0.21), -1.0),
)
KNOTS = np.array([1e-7, 5e-7, 2e-6])


@dataclass(frozen=True, kw_only=True)
class DenseRig:
    """(K + j omega C - omega^2 M) x = c F with modal damping, nothing reduced, in any form a test gives it.

    `damped_by` is the stiffness whose modes are damped: that at the moduli assumed.
    """

    M: Any
    K: Any
    damped_by: Any
    zeta: tuple[float, ...]
    drive: Any
    rows: Any

    @classmethod
    def of(cls, structure: Structure, base, *, KE=None, KG=None, K0=None, M=None):
        """The matrices of a structure at base parameters, or others in their place."""
        K0, M = (structure.K0 if K0 is None else K0), (structure.M if M is None else M)
        KE, KG = (structure.joints[0].KE if KE is None else KE), (structure.joints[0].KG if KG is None else KG)
        nominal = RIG.joint.preload["120N"]
        return cls(
            M=M,
            K=K0 + base.E * (1 + 1j * base.loss_E) * KE + base.G * (1 + 1j * base.loss_G) * KG,
            damped_by=K0 + nominal.normal_modulus * KE + nominal.shear_modulus * KG,
            zeta=tuple(base.zeta),
            drive=deflection(structure, RIG.drive.position),
            rows=np.array([structure.row(output.place) for output in OUTPUTS]),
        )

    def damping(self):
        """Of every mode its ratio; those above the identified ones have what the rig's last mode is assumed to."""
        squares, Phi = eigh(self.damped_by, self.M)
        zeta = np.full(len(squares), RIG.damping.modal_ratio[-1])
        zeta[: len(self.zeta)] = self.zeta
        MPhi = self.M @ Phi
        return MPhi @ np.diag(2 * zeta * np.sqrt(squares)) @ MPhi.T

    def displacement(self, omega, load=None, extra=None):
        """Of all degrees of freedom (f, n) under the drive's unit force, or another load (f, n).

        `extra` (f, n, n) is added to the dynamic stiffness.
        """
        w = np.asarray(omega)[:, None, None]
        Z = self.K + 1j * w * self.damping() - w**2 * self.M
        load = np.broadcast_to(self.drive, (len(w), len(self.drive))) if load is None else load
        return np.linalg.solve(Z if extra is None else Z + extra, load[:, :, None])[:, :, 0]

    def response(self, omega, load=None, extra=None):
        """What the channels read (f, o) per unit force."""
        return read(self.displacement(omega, load, extra) @ self.rows.T, omega)

    def having(self, **changes):
        """The same with other matrices."""
        return replace(self, **changes)


def read(displacement, omega):
    """Readings of the channels from displacements (f, o) at their places."""
    derivative = (1j * np.asarray(omega)[:, None]) ** np.array([2, 2, 1])
    return displacement * derivative * np.array([1, 1, -1])


def make_evidence(omega, response, *, force=1.0, spacing_s=2.0, with_harmonics=None, channels=OUTPUTS):
    """Steps with these fundamentals per force (s, o), and the same as broadband bins half way through the run."""
    model = build_linear_model(RIG, list(channels))
    count, outputs = response.shape
    F, A = np.zeros((count, HARMONICS), complex), np.zeros((count, outputs, HARMONICS), complex)
    F[:, 0] = force
    A[:, :, 0] = response * F[:, :1]
    if with_harmonics is not None:
        A[:, :, 1:] = with_harmonics
    time = np.arange(count) * spacing_s
    state = SimpleNamespace(run="r", sweep="s", target_amplitude=1.0)
    steps = StepArrays(
        omega=omega,
        force=F,
        force_variance=np.full((count, HARMONICS), 1e-16 * np.mean(np.abs(F[:, 0])) ** 2),
        response=A,
        response_variance=np.repeat(1e-16 * np.abs(A[:, :, :1]) ** 2, HARMONICS, axis=2),
        amplitude_m=np.abs(A[:, 1, 0]) / model.basis.omega[0] ** 2,
        time_s=time,
        growth=np.zeros(count),
        growth_std=np.zeros(count),
        states=cast("Any", (state,) * count),
    )
    bins = BinnedResponse(
        run="r", time_s=0.0, frequency_Hz=omega / (2 * np.pi), H=response,
        relative_covariance=np.tile(1e-16 * np.eye(outputs) + 0j, (count, 1, 1)),
        channels=tuple(o.channel for o in channels), noise_density={}, distortion=np.ones(count),
        force_power=np.zeros(count),
    )  # fmt: skip
    begun = Run(
        path="r", info={}, channels={}, devices={}, events=(),
        steps=(Step(time_ns=0, sweep="s", index=0, frequency_Hz=26.0, target_channel="force", target_amplitude=1.0,
                    state=StepState.MEASURING),),
    )  # fmt: skip
    return MeasuredData(
        rig=RIG, preload="120N", model=model, outputs=channels, force="force", reference=1, broadband=(bins,),
        steps=steps, unsettled=(), linear=None, runs=(begun,),
    )  # fmt: skip


@pytest.fixture(scope="session")
def baseline():
    """A linear joint, every base parameter away from what is assumed."""
    nominal = nominal_parameters(RIG)
    base = replace(nominal, E=1.1 * nominal.E, G=0.9 * nominal.G, loss_E=0.02, loss_G=0.05)
    base = replace(base, zeta=nominal.zeta * np.array([1.3, 0.8, 1.1, 1.2, 0.9]))
    return BaselineParameters(base, (LayerLaw.zero(KNOTS, KNOTS),))


@pytest.fixture(scope="session")
def structure():
    """The assumed structure."""
    return assemble(RIG)


@pytest.fixture(scope="session")
def dense(structure, baseline):
    """The nominal rig at the unknowns, densely."""
    return DenseRig.of(structure, baseline.base)


@pytest.fixture(scope="session")
def omega():
    """From below the first mode to the fourth, and closely about each resonance."""
    about = [f * (1 + width) for f in (26.2, 157.5, 471.0, 893.0) for width in (-0.01, -0.003, 0.0, 0.003, 0.01)]
    return 2 * np.pi * np.sort(np.concatenate([np.geomspace(8.0, 900.0, 24), about]))


@pytest.fixture(scope="session")
def by_hand():
    """The tools with which a test writes out a rig and its evidence."""
    return SimpleNamespace(evidence=make_evidence, DenseRig=DenseRig, read=read, rig=RIG, outputs=OUTPUTS)
