"""Numbers behind the pictures: receptances of steps, laws with their uncertainty, broadband responses."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from recordings.quantities import is_motion, is_response
from recordings.run import Run
from twin.arrays import Array
from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fit_problem import modification_of
from twin.diagnose.fitted_model import FittedModel
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.gauss_newton import Solution
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.spectra.resonances import by_resonance
from twin.identify.spectra.sine_fit import SteadyState, steady_states
from twin.structure import DrawnPart, Structure, drawn_places, layer_points
from twin.structure.mode_law import LayerModes, mode_functions
from twin.structure.modelled_rig import ModelledRig
from twin.views.plot import Range
from twin.views.receptance import per_force


@dataclass(frozen=True, kw_only=True)
class SteppedSweep:
    """One sweep of a run, in order of time."""

    name: str
    level: str
    """Target with its unit, such as ``1.5 N``."""
    frequency_Hz: Array
    time_s: Array
    """Time on the recording's own time base, (s,)."""
    receptance: dict[str, Array]
    """Displacement (mm) or strain (µm/m) per force (N) of each response channel, (s,); as it is where no force was
    recorded."""
    harmonics: dict[str, Array]
    """Amplitudes of harmonics 1, 2, ... of each response channel, in its unit, (s, h)."""


def stepped_sweeps(run: Run) -> tuple[SteppedSweep, ...]:
    """The sine sweeps of a run, reduced."""
    responses = [name for name, channel in run.channels.items() if is_response(channel.quantity)]
    force = next((name for name, channel in run.channels.items() if channel.quantity == "force"), None)
    recorded = {name for device in run.devices.values() for name in device.values}
    names = [name for name in [force, *responses] if name in recorded]
    if not set(names) & set(responses):
        return ()
    by_sweep: dict[str, list[SteadyState]] = {}
    for state in steady_states(run, channels=[name for name in names if name]):
        by_sweep.setdefault(state.sweep, []).append(state)
    return tuple(_sweep(run, name, states, force if force in recorded else None) for name, states in by_sweep.items())


def largest_receptance(run: Run, sweep: SteppedSweep) -> tuple[str, Array]:
    """Channel and receptance of the response that is largest in a sweep, of motions if any was recorded."""
    motions = {name: sizes for name, sizes in sweep.receptance.items() if is_motion(run.channels[name].quantity)}
    return max((motions or sweep.receptance).items(), key=lambda item: float(np.max(item[1])))


def _sweep(run: Run, name: str, states: Sequence[SteadyState], force: str | None) -> SteppedSweep:
    frequency_Hz = np.array([state.frequency_Hz for state in states])
    drive = np.array([abs(state.amplitude[force][0]) if force else 1.0 for state in states])
    receptance, harmonics = {}, {}
    for channel in states[0].amplitude:
        quantity = run.channels[channel].quantity
        if not is_response(quantity):
            continue
        sizes = np.full((len(states), 7), np.nan)
        for row, state in zip(sizes, states, strict=True):
            row[: len(state.amplitude[channel])] = np.abs(state.amplitude[channel][:7])
        harmonics[channel] = sizes
        receptance[channel] = per_force(sizes[:, 0] / drive, quantity, frequency_Hz)
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
    """One function of the joint's law with its standard deviation."""

    quantity: str
    """``softening`` or ``loss``."""
    joint: str = ""
    """Whose law it is; empty where there is but one."""
    amplitude_m: Array
    """Of a layer point's opening, or slip, (x,)."""
    value: Array
    std: Array
    """N/m2, (x,)."""
    reach_m: tuple[float, float]
    """From the least to the largest that the farthest point of any step moved; outside, no data reach, since points
    that move less than others hardly show in a response, and the function rests on its smoothness."""

    @property
    def function(self) -> str:
        """Its symbol, such as ``s(o)``."""
        return {"softening": "s(o)", "loss": "l(q)"}[self.quantity]

    @property
    def title(self) -> str:
        """What it does."""
        told = {"softening": "softening: E′ = E′₀ − s(o)", "loss": "loss: G′ = G′₀ + j l(q)"}[self.quantity]
        return f"{self.joint}, {told}" if self.joint else told

    @property
    def label(self) -> str:
        """Of its axis of amplitudes in micrometres."""
        return {"softening": "opening o of a layer point, µm", "loss": "slip q of a layer point, µm"}[self.quantity]

    @property
    def unmeasured_m(self) -> list[tuple[float, float]]:
        """Ranges of the amplitudes that no step reached."""
        smallest, largest = self.reach_m
        ends = ((float(self.amplitude_m[0]), smallest), (largest, float(self.amplitude_m[-1])))
        return [(low, high) for low, high in ends if low < high]


AnySweep = TypeVar("AnySweep", SteppedSweep, SweepComparison)


class Fitted(Protocol):
    """A fitted model of whatever kind."""

    @property
    def baseline(self) -> BaselineParameters:
        """The base family's parameters."""

    @property
    def solution(self) -> Solution:
        """The minimum that they are."""


def has_law(model: Fitted) -> bool:
    """Whether any joint's law was seen: by sine steps."""
    return any(np.any(law.vector) for law in model.baseline.laws)


def law_bands(evidence: MeasuredData, model: Fitted) -> tuple[LawBand, ...]:
    """Each joint's identified softening and loss over their knots; nothing where the data had no sine steps."""
    if not has_law(model):
        return ()
    baseline, covariance = model.baseline, model.solution.covariance
    bands: list[LawBand] = []
    for joint, (law, (opening, slip)) in enumerate(zip(baseline.laws, law_reach(evidence, model), strict=True)):
        o = np.geomspace(law.opening_knots[0], law.opening_knots[-1], 120)
        q = np.geomspace(law.slip_knots[0], law.slip_knots[-1], 120)
        for quantity, x, basis, part, reach in (
            ("softening", o, law.softening_basis(o), baseline.softening(joint), opening),
            ("loss", q, law.loss_basis(q), baseline.loss(joint), slip),
        ):
            variance = np.einsum("xi,ij,xj->x", basis, covariance[part, part], basis)
            std = np.sqrt(np.maximum(variance, 0.0))
            value, name = basis @ baseline.vector[part], joint_name(evidence, joint)
            bands.append(
                LawBand(quantity=quantity, joint=name, amplitude_m=x, value=value, std=std, reach_m=reach)
            )  # fmt: skip
    return tuple(bands)


def joint_name(evidence: MeasuredData, joint: int) -> str:
    """What tells a joint from others; empty where there is but one."""
    joints = evidence.rig.joints
    return joints[joint].name if len(joints) > 1 else ""


def law_reach(evidence: MeasuredData, model: Fitted) -> tuple[tuple[Range, Range], ...]:
    """For each joint, from the least to the largest opening, and slip, of its point that moves most in any step, m."""
    residual_model = ResidualModel(evidence, _extension(evidence, model))
    p = len(residual_model.points)
    motion = np.abs(residual_model.step_receptance(model.baseline, inner=False)[2].motion)
    found = []
    for joint in range(len(evidence.rig.joints)):
        own = residual_model.local.of_joint(joint)
        opening, slip = motion[:, own].max(axis=1), motion[:, p + own].max(axis=1)
        found.append(((float(opening.min()), float(opening.max())), (float(slip.min()), float(slip.max()))))
    return tuple(found)


@dataclass(frozen=True, kw_only=True)
class SeenByMode:
    """The law as uniform moduli E' - g1(X), G' + j g2(X) that act on one mode alike, as the papers have them."""

    number: int
    """Of the mode."""
    amplitude_m: Array
    """X, (x,): the acceleration amplitude of the reference channel over the square of that mode's natural frequency."""
    value: dict[str, Array]
    std: dict[str, Array]
    """``softening`` g1 and ``loss`` g2 with the constant loss of G', N/m2, (x,); NaN where no uniform moduli act
    alike."""


def law_in_lowest_mode(evidence: MeasuredData, model: Fitted, *, points: int = 60) -> SeenByMode:
    """The only joint's law as the lowest mode that was swept sees it, over the amplitudes that were measured there."""
    baseline, steps = model.baseline, evidence.steps
    base, (law,) = baseline.base, baseline.laws
    (E,), (G,) = base.E, base.G
    structure, output = evidence.model.structure, evidence.outputs[evidence.reference]
    modes = LayerModes.of(
        structure, layer_points(structure, evidence.rig.joints[0].layer_elements),
        E=E, G=G, sensor=structure.row(output.place),
    )  # fmt: skip
    rows = by_resonance(steps.omega)[0]
    number = 1 + int(np.argmin(np.abs(np.sqrt(modes.squares) - np.median(steps.omega[rows]))))
    measured = steps.amplitude_m[rows] * steps.omega[rows] ** 2 / modes.squares[number - 1]
    X = np.geomspace(measured.min(), measured.max(), points)
    seen = mode_functions(modes, law.softening_at, law.loss_at, X, number=number)
    opening, slip = np.split(seen.motion_m, 2, axis=1)
    by_law = np.concatenate(
        [
            np.einsum("xgp,xpk->xgk", by_point, basis)
            for by_point, basis in zip(
                np.split(seen.by_moduli, 2, axis=2), (law.softening_basis(opening), law.loss_basis(slip)), strict=True
            )
        ],
        axis=2,
    )
    part = baseline.of_laws
    variance = np.einsum("xgi,ij,xgj->gx", by_law, model.solution.covariance[part, part], by_law)
    std = np.sqrt(np.maximum(variance, 0.0))
    return SeenByMode(
        number=number,
        amplitude_m=X,
        value={"softening": seen.softening, "loss": G * base.loss_G[0] + seen.loss},
        std={"softening": std[0], "loss": std[1]},
    )


def parted(sweep: SteppedSweep) -> list[SteppedSweep]:
    """One sweep through several resonances as one for each."""
    groups = by_resonance(sweep.frequency_Hz)
    if len(groups) == 1:
        return [sweep]
    return [
        replace(
            sweep,
            frequency_Hz=sweep.frequency_Hz[rows],
            time_s=sweep.time_s[rows],
            receptance={name: values[rows] for name, values in sweep.receptance.items()},
            harmonics={name: values[rows] for name, values in sweep.harmonics.items()},
        )
        for rows in groups
    ]


def each_resonance(sweeps: Sequence[AnySweep]) -> Iterator[tuple[str, str, list[AnySweep]]]:
    """The sweeps about each resonance, the lowest first, behind what tells it apart.

    A path such as ``/1`` and a name such as ``155 Hz``; both are empty where there is but one.
    """
    middle = np.array([np.median(sweep.frequency_Hz) for sweep in sweeps])
    groups = by_resonance(middle) if sweeps else []
    for number, group in enumerate(groups, 1):
        about = [sweeps[i] for i in group]
        name = f"{np.median(np.concatenate([sweep.frequency_Hz for sweep in about])):.3g} Hz"
        yield (f"/{number}", name, about) if len(groups) > 1 else ("", "", about)


def modelled_by(evidence: MeasuredData, model: Fitted) -> ModelledRig:
    """The structure at the identified moduli with its modes, what an extension attaches left out."""
    base = model.baseline.base
    return ModelledRig.of(evidence.rig, evidence.model.structure, base.E, base.G)


def sensor_places(evidence: MeasuredData, structure: Structure | None = None) -> DrawnPart:
    """Where the sensors are, as one part to draw: on the assumed structure, or on one with other degrees of freedom."""
    return drawn_places(
        structure or evidence.model.structure, [output.place for output in evidence.outputs], name="sensors"
    )


def compared_models(diagnosis: Diagnosis) -> dict[str, FittedModel]:
    """The base family as ``before``, and as ``after`` the extended model where the verdict stands by one."""
    search = diagnosis.search
    if diagnosis.verdict in ("explained", "ambiguous") and search.model.hypotheses:
        return {"before": search.base, "after": search.model}
    return {"before": search.base}


def shown_models(diagnosis: Diagnosis) -> dict[str, FittedModel]:
    """As :func:`compared_models`; a single one, which is neither before nor after anything, is called ``model``."""
    models = compared_models(diagnosis)
    return models if len(models) > 1 else {"model": models["before"]}


def broadband_responses(evidence: MeasuredData, model: Fitted, index: int) -> Array:
    """What a model predicts of broadband run `index`: responses per force at its bins, (b, o), unit/N."""
    residual_model = ResidualModel(evidence, _extension(evidence, model))
    return broadband_response(residual_model, evidence.broadband[index], model.baseline)


def _extension(evidence: MeasuredData, model: Fitted) -> ModelModification | None:
    """What the causes of a fitted model change; nothing is changed in any other model."""
    return modification_of(evidence, model.hypotheses) if isinstance(model, FittedModel) else None
