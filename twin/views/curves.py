"""Numbers behind the pictures: receptances of steps, laws with their uncertainty, mode shapes, broadband responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from recordings.run import Run
from twin.diagnose.candidate import Candidate, extension_of
from twin.diagnose.result import Diagnosis
from twin.identify.evidence import Evidence
from twin.identify.gauss_newton import Solution
from twin.identify.prediction import Predictor
from twin.identify.sine_fit import SteadyState, steady_states
from twin.identify.unknowns import Unknowns
from twin.structure import normal_modes
from twin.views.receptance import POWERS, receptance_mm_per_N

__all__ = [
    "Fitted",
    "LawBand",
    "ModeShape",
    "SteppedSweep",
    "broadband_responses",
    "compared_models",
    "law_band",
    "mode_shapes",
    "shown_models",
    "stepped_sweeps",
]

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class SteppedSweep:
    """One sweep of a run, in order of time.

    Attributes
    ----------
    level : str
        Target with its unit, such as ``1.5 N``.
    frequency_Hz, time_s : ndarray, (s,)
        Time on the recording's own time base.
    receptance : dict of ndarray, (s,)
        Displacement amplitude per force amplitude of each response channel, mm/N; in mm where no force was recorded.
    harmonics : dict of ndarray, (s, h)
        Amplitudes of harmonics 1, 2, ... of each response channel, in its unit.
    """

    name: str
    level: str
    frequency_Hz: Array
    time_s: Array
    receptance: dict[str, Array]
    harmonics: dict[str, Array]


def stepped_sweeps(run: Run, *, harmonics: int = 7) -> tuple[SteppedSweep, ...]:
    """The sine sweeps of a run, reduced."""
    responses = [name for name, channel in run.channels.items() if channel.quantity in POWERS]
    force = next((name for name, channel in run.channels.items() if channel.quantity == "force"), None)
    recorded = {name for device in run.devices.values() for name in device.values}
    names = [name for name in [force, *responses] if name in recorded]
    if not set(names) & set(responses):
        return ()
    by_sweep: dict[str, list[SteadyState]] = {}
    for state in steady_states(run, channels=[name for name in names if name]):
        by_sweep.setdefault(state.sweep, []).append(state)
    return tuple(
        _sweep(run, name, states, force if force in recorded else None, harmonics)
        for name, states in by_sweep.items()
    )  # fmt: skip


def _sweep(run: Run, name: str, states: Sequence[SteadyState], force: str | None, count: int) -> SteppedSweep:
    frequency_Hz = np.array([state.frequency_Hz for state in states])
    drive = np.array([abs(state.amplitude[force][0]) if force else 1.0 for state in states])
    receptance, harmonics = {}, {}
    for channel in states[0].amplitude:
        quantity = run.channels[channel].quantity
        if quantity not in POWERS:
            continue
        sizes = np.full((len(states), count), np.nan)
        for row, state in zip(sizes, states, strict=True):
            row[: len(state.amplitude[channel])] = np.abs(state.amplitude[channel][:count])
        harmonics[channel] = sizes
        receptance[channel] = receptance_mm_per_N(sizes[:, 0] / drive, quantity, frequency_Hz)
    target = states[0]
    unit = run.channels[target.target_channel].unit if target.target_channel in run.channels else ""
    return SteppedSweep(
        name=name,
        level=f"{target.target_amplitude:g} {unit}".strip(),
        frequency_Hz=frequency_Hz,
        time_s=np.array([state.time_s for state in states]),
        receptance=receptance,
        harmonics=harmonics,
    )


@dataclass(frozen=True, kw_only=True)
class LawBand:
    """Softening s(X) and loss l(X) of the joint, N/m2, with their standard deviations, at amplitudes X in m."""

    amplitude_m: Array
    softening: Array
    softening_std: Array
    loss: Array
    loss_std: Array


class Fitted(Protocol):
    """A fitted model of whatever kind."""

    @property
    def unknowns(self) -> Unknowns:
        """The base family's parameters."""

    @property
    def solution(self) -> Solution:
        """The minimum that they are."""


def law_band(model: Fitted, *, points: int = 120) -> LawBand | None:
    """The identified law over the amplitudes it was identified on; None where the data had no sine steps."""
    law = model.unknowns.law
    if not (np.any(law.softening) or np.any(law.loss)):
        return None
    X = np.geomspace(law.knots[0], law.knots[-1], points)
    basis = law.basis(X)
    start, k = len(model.unknowns.base.vector), len(law.knots)
    covariance = model.solution.covariance

    def std(first: int) -> Array:
        block = covariance[first : first + k, first : first + k]
        return np.sqrt(np.maximum(np.einsum("xi,ij,xj->x", basis, block, basis), 0.0))

    return LawBand(
        amplitude_m=X,
        softening=basis @ law.softening,
        softening_std=std(start),
        loss=basis @ law.loss,
        loss_std=std(start + k),
    )


@dataclass(frozen=True, kw_only=True)
class ModeShape:
    """A normal mode along both beams, scaled to a largest deflection of 1.

    Attributes
    ----------
    lower_x, upper_x : ndarray
        Positions along the rig, m.
    lower, upper : ndarray
        Deflections v across the beams, at the nodes.
    layer_x, opening, slip : ndarray
        Of the layer between the beams, on the same scale: how it opens across, and slides along.
    """

    number: int
    frequency_Hz: float
    lower_x: Array
    upper_x: Array
    lower: Array
    upper: Array
    layer_x: Array
    opening: Array
    shear_x: Array
    slip: Array


def mode_shapes(evidence: Evidence, model: Fitted, *, count: int = 4) -> tuple[ModeShape, ...]:
    """The first modes of the structure at the identified moduli, the extension's attachments left out."""
    s = evidence.model.structure
    base = model.unknowns.base
    modes = normal_modes(s.M, s.stiffness(base.E, base.G), count)
    nodes = len(s.mesh.lower_x)
    shapes = []
    for i in range(modes.Phi.shape[1]):
        phi = modes.Phi[:, i]
        full = np.zeros(3 * s.mesh.nodes)
        full[s.free] = phi
        v = full[1::3]
        scale = 1.0 / v[np.argmax(np.abs(v))]
        shapes.append(
            ModeShape(
                number=i + 1,
                frequency_Hz=float(modes.frequency_Hz[i]),
                lower_x=s.mesh.lower_x,
                upper_x=s.mesh.upper_x,
                lower=scale * v[:nodes],
                upper=scale * v[nodes:],
                layer_x=s.layer_x,
                opening=scale * (s.B_E @ phi) / s.normal_weight,
                shear_x=s.shear_x,
                slip=scale * (s.B_G @ phi) / s.shear_weight,
            )
        )
    return tuple(shapes)


def compared_models(diagnosis: Diagnosis) -> dict[str, Candidate]:
    """The base family as ``before``, and as ``after`` the extended model where the verdict stands by one."""
    search = diagnosis.search
    if diagnosis.verdict in ("explained", "ambiguous") and search.model.blames:
        return {"before": search.base, "after": search.model}
    return {"before": search.base}


def shown_models(diagnosis: Diagnosis) -> dict[str, Candidate]:
    """As :func:`compared_models`; a single one, which is neither before nor after anything, is called ``model``."""
    models = compared_models(diagnosis)
    return models if len(models) > 1 else {"model": models["before"]}


def broadband_responses(evidence: Evidence, model: Fitted, index: int) -> Array:
    """What a model predicts of broadband run `index`: responses per force at its bins, (b, o), unit/N."""
    extension = extension_of(evidence, model.blames) if isinstance(model, Candidate) else None
    return Predictor(evidence, extension).broadband_response(evidence.broadband[index], model.unknowns)
