"""Everything a set of recordings holds, reduced to numbers with their noise: what identification and diagnosis see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from recordings.errors import InputError
from recordings.quantities import quantity
from recordings.run import Run
from recordings.sweeps import measured_stretches
from recordings.whereabouts import working_on
from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.linear.changed_model import ChangedModels
from twin.identify.linear.linear_fit import LinearFit, reduce_broadband
from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model, nominal_parameters
from twin.identify.model_modification import ModelModification
from twin.identify.nominal_instruments import nominal_instruments
from twin.identify.rig_channels import drive_of, faces_against, in_directions_of
from twin.identify.spectra.broadband import BinnedResponse
from twin.identify.spectra.settled import still_changing
from twin.identify.spectra.sine_fit import Line, SteadyState, steady_states
from twin.identify.spectra.spectrum import broadband_records
from twin.identify.spectra.sweeps import rows_by_sweep
from twin.rigs import Place, Rig, Shaker, ThinLayer, nearest_preload, preload_name, recorded_preload


class Known(Protocol):
    """Something that a rig file knows to differ from its structure and joint."""

    def modification(self, evidence: MeasuredData) -> ModelModification:
        """How it acts in a prediction."""
        ...


@dataclass(frozen=True)
class StepArrays:
    """Steady states as arrays: s steps, o response channels, h harmonics (1 ... HARMONICS).

    `amplitude_m` is the displacement amplitude at the reference channel; `growth` is the rate, 1/s, at which that
    channel's complex fundamental still changed within each measurement, over itself, and `growth_std` the standard
    deviation of its real and of its imaginary part.  `drive` is the number of the rig's drive, that of the first if
    left out.  `force_ratio` (s, h) is the force over the reference channel's response, and `force_ratio_std` its
    relative error: both are there for harmonics whose sizes an anti-aliasing filter leaves unknown, too.
    """

    omega: Array
    force: Array
    force_variance: Array
    response: Array
    response_variance: Array
    amplitude_m: Array
    time_s: Array
    growth: Array
    growth_std: Array
    states: tuple[SteadyState, ...]
    drive: Array = field(default_factory=lambda: np.zeros(0, int))
    force_ratio: Array = field(default_factory=lambda: np.zeros((0, 0), complex))
    force_ratio_std: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        if not len(self.drive):
            object.__setattr__(self, "drive", np.zeros(len(self.omega), int))
        if not len(self.force_ratio):
            object.__setattr__(self, "force_ratio", np.zeros_like(self.force))
            object.__setattr__(self, "force_ratio_std", np.full(self.force.shape, np.inf))

    def __len__(self) -> int:
        return len(self.omega)

    @cached_property
    def by_sweep(self) -> dict[str, Array]:
        """Rows of each sweep, see :func:`~twin.identify.spectra.sweeps.rows_by_sweep`."""
        return rows_by_sweep(self.states)

    @property
    def complex_omega(self) -> Array:
        """Frequency at which the rig answers as it did while it still changed, rad/s: i omega + growth, over i.

        To first order in the change, D(i omega + d/dt) q = F with dq/dt = growth q.
        """
        return np.asarray(self.omega - 1j * self.growth)

    def select(self, keep: Array) -> StepArrays:
        """The steps where `keep` is true."""
        picked = tuple(state for state, use in zip(self.states, keep, strict=True) if use)
        arrays = {f.name: getattr(self, f.name)[keep] for f in fields(self) if f.name != "states"}
        return StepArrays(states=picked, **arrays)


@dataclass(frozen=True, kw_only=True)
class MeasuredData:
    """Reduced recordings, and the nominal rig that they are held against."""

    rig: Rig
    preload: str
    model: LinearModel
    outputs: tuple[Output, ...]
    force: str
    reference: int
    broadband: tuple[BinnedResponse, ...]
    steps: StepArrays
    """Settled steps."""
    unsettled: tuple[SteadyState, ...]
    """Steps that were still changing; left out of the fits, and told."""
    linear: LinearFit | None
    """Base parameters from the last broadband run alone."""
    runs: tuple[Run, ...]
    dropped: int = 0
    effects: tuple[Known, ...] = ()
    """Of the rig file; every prediction has them."""
    begun_s: float | None = None
    """Time from which drifts count, on the recordings' time base; that of the first step of `runs` if left out."""
    frequency_scatter: float = 0.0
    """Relative standard deviation of what the natural frequencies are off by from one assembly of the rig to the next,
    in the mean of the cases that were measured."""
    shape_error: float = 0.0
    """Relative error of each mode's share in each response that a sound rig has; 0 where none is looked for."""

    def __getstate__(self) -> dict[str, Any]:
        """What another process fits to: all but the samples, from which this one reduced it."""
        kept = {name: value for name, value in vars(self).items() if name not in ("changed_models", "known")}
        return kept | {"runs": (), "begun_s": self.origin_s}

    @cached_property
    def known(self) -> ModelModification:
        """What the rig file says beside its structure and joint: its instruments, then its effects one by one."""
        whole = nominal_instruments(self.rig)
        for number, effect in enumerate(self.effects):
            whole = whole.merged(effect.modification(replace(self, effects=self.effects[:number])))
        return whole

    @cached_property
    def joints(self) -> tuple[ThinLayer, ...]:
        """The rig's; its file's format may have to make them anew."""
        return self.rig.joints

    @cached_property
    def changed_models(self) -> ChangedModels:
        """Models of the rig with another structure than assumed."""
        return ChangedModels(self.rig, self.preload)

    @cached_property
    def reference_omega(self) -> float:
        """First natural frequency as assumed, rad/s: it turns accelerations into equivalent amplitudes."""
        return float(self.model.basis.omega[0])

    @cached_property
    def origin_s(self) -> float:
        """Time from which drifts count, on the recordings' time base."""
        if self.begun_s is not None:
            return self.begun_s
        return min(step.time_ns for run in self.runs for step in run.steps) * 1e-9

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the files that this was reduced from."""
        return tuple(dict.fromkeys([run.path for run in self.runs] or [data.run for data in self.broadband]))

    @property
    def units(self) -> dict[str, str]:
        """Of the response channels."""
        return {output.channel: quantity(output.quantity).unit for output in self.outputs}

    @property
    def as_modelled(self) -> Array:
        """Logarithms of what each response shows of each mode over what the model says, to begin with."""
        return np.zeros(len(self.outputs) * LIMITS.damped_modes if self.shape_error else 0)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the response channels."""
        return tuple(output.channel for output in self.outputs)

    def without_steps(self) -> MeasuredData:
        """The broadband runs alone."""
        return replace(self, steps=self.steps.select(np.zeros(len(self.steps), bool)))

    @property
    def unused_told(self) -> tuple[str, ...]:
        """A sentence on the rig's response channels of which not every recording has samples; none without any."""
        names = ", ".join(s.channel for s in self.rig.response_sensors if s.channel not in self.channels)
        return (f"the rig's {names} was not used: not all recordings have samples of it",) if names else ()

    @cached_property
    def shakers(self) -> tuple[Shaker, ...]:
        """Of the rig's drives."""
        return tuple(self.rig.driven_by(name).shaker for name in self.rig.drives)


HARMONICS = 7


def gather_data(
    runs: Sequence[Run], rig: Rig, *, preload: str | None = None, lines: Mapping[str, Line] | None = None
) -> MeasuredData:
    """Reduce `runs` against `rig`.

    Parameters
    ----------
    preload
        The rig's preload; :func:`common_preload` of the recordings if not given.
    lines
        Foreign lines by channel, such as mains hum, which sines are fitted beside.

    Raises
    ------
    InputError
        If the recordings measured nothing; as :func:`response_outputs` and :func:`common_preload`.
    """
    first = runs[0]
    force = rig.force_sensor.channel
    outputs = response_outputs(runs, rig)
    runs = [in_directions_of(run, first, rig) for run in runs]
    preload = preload or common_preload(runs, rig)
    model = build_linear_model(rig, list(outputs), preload=preload)
    nominal = nominal_parameters(rig, preload)
    binned, fit = [], None
    used = [force, *(output.channel for output in outputs)]
    states: list[SteadyState] = []
    drives = {run.path: [*rig.drives].index(drive_of(run, rig)) for run in runs}
    sideways = any(rig.driven_by(name).shaker.stinger_lateral_stiffness for name in rig.drives)
    if sideways and len({*drives.values()}) > 1:
        reason = "another drive than the first run's, whose stinger holds the structure by stinger_lateral_stiffness"
        other = next(run.path for run in runs if drives[run.path] != drives[first.path])
        raise InputError(other, "metadata run", reason, "take the runs of each drive by themselves")
    for run in runs:
        drive = drives[run.path]
        own = model.with_places(outputs, [[*rig.drives.values()][drive]])
        with working_on(run.path):
            for record in broadband_records(run, channels=used):
                data, fit = reduce_broadband(own, record, nominal, force=force)
                binned.append(replace(data, drive=drive))
            states += steady_states(run, channels=used, lines=lines)
    if not binned and not states:
        raise InputError(
            first.path, "/procedure", "no measured step in any of the recordings", "run 'twin check' on it"
        )
    reference = reference_output(model)
    changing = still_changing(states, [outputs[reference].channel], force=force)
    settled = [state for state, moves in zip(states, changing, strict=True) if not moves]
    asked_for = sum(one.step.frequency_Hz > 0 for run in runs for one in measured_stretches(run))
    return MeasuredData(
        rig=rig,
        preload=preload,
        model=model,
        outputs=outputs,
        force=force,
        reference=reference,
        broadband=tuple(binned),
        steps=replace(
            _arrays(settled, force, outputs, reference), drive=np.array([drives[state.run] for state in settled], int)
        ),
        unsettled=tuple(state for state, moves in zip(states, changing, strict=True) if moves),
        linear=fit,
        runs=tuple(runs),
        dropped=asked_for - len(states),
    )


def response_outputs(runs: Sequence[Run], rig: Rig) -> tuple[Output, ...]:
    """The rig's response channels that all recordings have, as the first one says of their quantity and direction.

    InputError if the recordings lack the rig's force channel, share no response channel with the rig, or one lies
    across it.
    """
    first, force = runs[0], rig.force_sensor.channel
    present = set.intersection(*(set(run.channels) for run in runs))
    if force not in present:
        raise InputError(first.path, f"channel {force}", "not recorded", "the rig names its force channel so")
    outputs = tuple(
        Output(
            sensor.channel,
            first.channels[sensor.channel].quantity,
            rig.place_of(sensor.channel),
            -1.0 if faces_against(first.channels[sensor.channel], first, rig) else 1.0,
        )
        for sensor in rig.response_sensors
        if sensor.channel in present
    )
    if not outputs:
        raise InputError(first.path, "channels", f"none of the rig's response channels is recorded, only {present}")
    return outputs


def reference_output(model: LinearModel) -> int:
    """Number of the output whose motion is largest in the first mode; of a strain, if none is of motion."""
    motion = np.abs(model.ports.rows[model.ports.outputs] @ model.basis.Phi[:, 0])
    moves = np.array([output.place.reads == "displacement" for output in model.outputs])
    return int(np.argmax(np.where(moves, motion, 0.0) if np.any(moves) else motion))


def common_preload(runs: Sequence[Run], rig: Rig) -> str:
    """The rig's preload that the recordings were made at; its first where they do not say.

    InputError if they were made at different ones.
    """
    found = {nearest_preload(rig, run.info)[0]: run.path for run in runs if recorded_preload(run.info)}
    if len(found) > 1:
        reason = f"the runs differ in preload: {', '.join(found)}"
        raise InputError([*found.values()][1], "metadata run", reason, "take the runs of each preload by themselves")
    return next(iter(found), preload_name(rig))


def no_steps(outputs: int) -> StepArrays:
    """Steady states where no sine was measured."""
    none = np.zeros(0)
    force, response = np.zeros((0, HARMONICS), complex), np.zeros((0, outputs, HARMONICS), complex)
    return StepArrays(
        none, force, force.real, response, response.real, none, none, none + 0j, none, ()
    )  # fmt: skip


def _clock_error(states: list[SteadyState], force: str) -> float:
    """Relative error of the sampling clock: all channels turn together by it, and nothing still changes."""
    turn = np.array([state.drift[force].imag for state in states])
    weight = np.array([1 / state.drift_std[force] ** 2 for state in states])
    angle = np.array([state.omega * state.duration_s for state in states])
    return float(np.sum(weight * turn * angle) / np.sum(weight * angle**2)) if states else 0.0


def _arrays(states: list[SteadyState], force: str, outputs: tuple[Output, ...], reference: int) -> StepArrays:
    def harmonics(values: Array, fill: float) -> Array:
        out = np.full(HARMONICS, fill, values.dtype)
        out[: min(HARMONICS, len(values))] = values[:HARMONICS]
        return out

    omega = np.array([state.omega for state in states])
    shape = (len(states), len(outputs), HARMONICS)
    F = np.array([harmonics(s.amplitude[force], 0.0) for s in states]).reshape(len(states), HARMONICS)
    F_var = np.array([harmonics(s.variance[force], np.inf) for s in states]).reshape(len(states), HARMONICS)
    A = np.array([[harmonics(s.amplitude[o.channel], 0.0) for o in outputs] for s in states]).reshape(shape)
    A_var = np.array([[harmonics(s.variance[o.channel], np.inf) for o in outputs] for s in states]).reshape(shape)
    amplitude = np.abs(A[:, reference, 0]) / omega ** outputs[reference].derivative
    time = np.array([state.time_s for state in states])
    channel = outputs[reference].channel
    growth = np.array([state.drift[channel] / state.duration_s for state in states], complex)
    growth = growth - 1j * omega * _clock_error(states, force)
    growth_std = np.array([state.drift_std[channel] / state.duration_s for state in states])
    ratios = [state.ratio(force, channel) for state in states]
    ratio = np.array([harmonics(each, 0.0) for each, _ in ratios], complex).reshape(F.shape)
    ratio_std = np.array([harmonics(error, np.inf) for _, error in ratios]).reshape(F.shape)
    return StepArrays(
        omega, F, F_var, A, A_var, amplitude, time, growth, growth_std, tuple(states),
        force_ratio=ratio, force_ratio_std=ratio_std,
    )  # fmt: skip


def drive_places(evidence: MeasuredData) -> tuple[Place, ...]:
    """Where each of the rig's drives is known to act."""
    off, layout = evidence.known.drive_offset_m, evidence.rig.layout()
    return tuple(layout.moved(place, off.get(name, 0.0)) for name, place in evidence.rig.drives.items())


def output_place(evidence: MeasuredData, channel: str) -> Place:
    """Where a response channel is known to measure."""
    nominal = next(output.place for output in evidence.outputs if output.channel == channel)
    return evidence.rig.layout().moved(nominal, evidence.known.output_offset_m.get(channel, 0.0))
