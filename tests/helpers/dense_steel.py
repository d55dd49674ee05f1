"""The steel rig's linear model, the same physics solved densely, and evidence put together by hand."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from beam_rows import deflection

from recordings.run import Run, Step, StepState
from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model, nominal_parameters
from twin.identify.measured_data import HARMONICS, MeasuredData, StepArrays
from twin.identify.spectra.broadband import BinnedResponse
from twin.rigs import load_rig, preload_name
from twin.structure import layer_points


@dataclass(frozen=True)
class Dense:
    """Displacements by solving K + j omega C - omega^2 M, from nothing of the model but its assumed modes' shapes."""

    model: LinearModel

    def field(self, loads, omega, base, dE=0.0, dG=0.0, held=0.0):
        """Displacements (f, l, n) of all degrees of freedom under loads (l, n), `held` by more stiffness."""
        s, reference = self.model.structure, self.model.basis
        MPhi, count = s.M @ reference.Phi, len(base.zeta)
        w, zeta = reference.omega.copy(), reference.zeta.copy()
        w[:count] *= np.sqrt(1 + 2 * base.frequency_discrepancy)
        zeta[:count] = base.zeta
        C = MPhi @ np.diag(2 * zeta * w) @ MPhi.T
        K = s.K0 + MPhi @ np.diag(w**2 - reference.omega**2) @ MPhi.T
        E = np.broadcast_to(base.complex_E[0] + np.ravel(dE), len(omega))
        G = np.broadcast_to(base.complex_G[0] + np.ravel(dG), len(omega))
        rows = zip(omega, E, G, strict=True)
        Z = held + np.array([K + e * s.joints[0].KE + g * s.joints[0].KG + 1j * w * C - w**2 * s.M for w, e, g in rows])
        return np.linalg.solve(Z, np.broadcast_to(loads.T, (len(omega), *loads.T.shape))).swapaxes(1, 2)

    def modal_stiffness(self, relative):
        """Stiffness (f, n, n) of the damped modes at rest, times a relative error (f, m) of each."""
        count = relative.shape[1]
        MPhi = self.model.structure.M @ self.model.basis.Phi[:, :count]
        return (MPhi * (self.model.basis.omega[:count] ** 2 * relative)[:, None, :]) @ MPhi.T

    def accelerance(self, omega, base, dE=0.0, dG=0.0, held=0.0):
        """Accelerations (f, o) at the outputs' places for a unit force at the drive."""
        s = self.model.structure
        x = self.field(deflection(s, 0.05)[None], omega, base, dE, dG, held)[:, 0]
        return -(omega[:, None] ** 2) * (x @ np.array([s.row(o.place) for o in self.model.outputs]).T)

    def point_receptance(self, omega, base, held):
        """Among drive, the layer's six openings and slips, and the outputs' places, (f, q, q), all without the law."""
        s = self.model.structure
        points = layer_points(s, 3)
        rows = np.array([deflection(s, 0.05), *points.rows, *(s.row(o.place) for o in self.model.outputs)])
        return self.field(rows, omega, base, held=held) @ rows.T, points.weights

    def with_law(self, omega, tip_m, base, law, held=0.0):
        """Accelerances (f, o) and the points' complex motion (f, 6) where the tip moves by `tip_m` (f,)."""
        R, weight = self.point_receptance(omega, base, held)
        into, among, from_drive = R[:, :, 0], R[:, 1:7, 1:7], R[:, 1:7, 0]
        amplitude = np.zeros(from_drive.shape)
        for _ in range(300):
            s, loss = law.softening_at(amplitude[:, :3]), law.loss_at(amplitude[:, 3:])
            k = weight * np.concatenate([-s, 1j * loss], axis=1)
            # The law's forces on the points, for a unit force at the drive.
            push = -k * np.linalg.solve(np.eye(6) + among * k[:, None, :], from_drive[:, :, None])[:, :, 0]
            moved = into + np.einsum("fqp,fp->fq", R[:, :, 1:7], push)
            motion = moved[:, 1:7] / moved[:, -1:] * tip_m[:, None]
            last, amplitude = amplitude, 0.5 * (amplitude + np.abs(motion))
            if np.max(np.abs(amplitude - last)) < 1e-12 * np.max(amplitude):
                return -(omega[:, None] ** 2) * moved[:, 7:], motion
        raise ArithmeticError("the layer's points do not come to rest")

    def layer_shares(self, omega, base, dE, dG):
        """The layer's opening and slip (f,) per motion of the last output, over those in the first mode, (2, f)."""
        s = self.model.structure
        tip = s.row(self.model.outputs[-1].place)
        x = self.field(deflection(s, 0.05)[None], omega, base, dE, dG)[:, 0]
        shares = np.zeros((2, len(omega)))
        for k, w in enumerate(omega):
            K = s.K0 + (base.E[0] + np.broadcast_to(dE, len(omega))[k]) * s.joints[0].KE
            K = K + (base.G[0] + np.broadcast_to(dG, len(omega))[k]) * s.joints[0].KG
            mode, value = x[k], w**2
            for _ in range(8):
                mode = np.linalg.solve(K - (1 + 1e-9) * value * s.M, s.M @ mode)
                value = (mode @ K @ mode) / (mode @ s.M @ mode)
            for row, B in zip(shares, (s.joints[0].B_E, s.joints[0].B_G), strict=True):
                forced, free = (np.linalg.norm(B @ u) / abs(tip @ u) for u in (x[k], mode))
                # The sensor's X is its acceleration's, at one frequency here and at the mode's there.
                row[k] = forced / free * abs(value) / w**2
        return shares

    def moduli(self, omega, X, base, softening, loss):
        """g1 and g2 (f,) by their coefficients, of what the layer does at the sensor's amplitudes X; and the shares."""
        shares = np.ones((2, len(omega)))
        for _ in range(3):
            laws = zip(shares, (softening, loss), strict=True)
            g1, g2 = (np.polynomial.polynomial.polyval(X * share, law) for share, law in laws)
            shares = self.layer_shares(omega, base, -g1, 1j * g2)
        return g1, g2, shares


@pytest.fixture(scope="session")
def steel_model():
    """Two accelerometers on the steel rig."""
    rig = load_rig("steel-lap-joint")
    outputs = [Output(channel, "acceleration", rig.place_of(channel)) for channel in ("acc1", "acc2")]
    return build_linear_model(rig, outputs)


@pytest.fixture(scope="session")
def steel_dense(steel_model):
    """Its dense solution."""
    return Dense(steel_model)


@pytest.fixture(scope="session")
def other_base():
    """Base parameters away from what is assumed in every entry."""
    nominal = nominal_parameters(load_rig("steel-lap-joint"))
    return replace(
        nominal,
        E=1.1 * nominal.E,
        G=0.9 * nominal.G,
        loss_E=0.02,
        loss_G=0.05,
        zeta=nominal.zeta * np.array([1.3, 0.8, 1.1, 1.2, 0.9]),
        frequency_discrepancy=np.array([1e-3, -2e-3, 3e-3, 0.0, 1e-3]),
    )


BEGUN = Run(
    path="r", info={}, channels={}, devices={}, events=(),
    steps=(Step(time_ns=0, sweep="s", index=0, frequency_Hz=26.0, target_channel="force", target_amplitude=1.0,
                state=StepState.MEASURING),),
)  # fmt: skip
"""What a run tells of when it began."""


class Build:
    """Measured data whose responses and variances a test chooses."""

    @staticmethod
    def steps(omega, force, response, *, relative=1e-4, time_s=None, growth=0.0, growth_std=0.0):
        """Steps from force (s, h) and response (s, o, h), noise of a relative size in every harmonic."""
        count, outputs, harmonics = response.shape
        F = np.zeros((count, HARMONICS), complex)
        A = np.zeros((count, outputs, HARMONICS), complex)
        F[:, : force.shape[1]], A[:, :, :harmonics] = force, response
        F_variance = np.repeat((relative * np.abs(F[:, :1])) ** 2, HARMONICS, axis=1)
        A_variance = np.repeat((relative * np.abs(A[:, :, :1])) ** 2, HARMONICS, axis=2)
        return StepArrays(
            omega=omega,
            force=F,
            force_variance=F_variance,
            response=A,
            response_variance=A_variance,
            amplitude_m=np.abs(A[:, -1, 0]) / omega**2,
            time_s=np.arange(count) * 2.0 if time_s is None else time_s,
            growth=np.full(count, growth, complex),
            growth_std=np.full(count, growth_std),
            states=(SimpleNamespace(run="run", sweep="sweep"),) * count,
        )

    @staticmethod
    def bins(frequency_Hz, H, covariance, *, time_s=0.0):
        """A binned broadband response of two accelerometers."""
        return BinnedResponse(
            run="r", time_s=time_s, frequency_Hz=frequency_Hz, H=H, relative_covariance=covariance,
            channels=("acc1", "acc2"), noise_density={}, distortion=np.ones(len(frequency_Hz)),
            force_power=np.zeros(len(frequency_Hz)),
        )  # fmt: skip

    @staticmethod
    def evidence(model, steps, broadband=()):
        """Measured data of the steel rig."""
        rig = load_rig("steel-lap-joint")
        return MeasuredData(
            rig=rig, preload=preload_name(rig), model=model, outputs=model.outputs, force="force",
            reference=len(model.outputs) - 1, broadband=tuple(broadband), steps=steps, unsettled=(), linear=None,
            runs=(BEGUN,),
        )  # fmt: skip


@pytest.fixture(scope="session")
def build():
    """Builders of evidence."""
    return Build
