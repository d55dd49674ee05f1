"""The streaming rig: physics, instruments and converter behind the interface of a source of samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from recordings.run import Channel, SampleBlock
from recordings.streams import Excitation
from twin.arrays import Array
from twin.bench.build import Built, build
from twin.bench.decimation import decimate, decimation_taps
from twin.bench.generator import Generator, pulse
from twin.bench.instruments import Conversion, InstrumentChannel, convert, high_pass_coefficients
from twin.bench.layer import JointLaw
from twin.bench.limits import LIMITS
from twin.bench.marching import coefficients, integrate, packed
from twin.bench.plan import Plan
from twin.bench.planned import planned
from twin.bench.shaker import ShakerModel
from twin.rigs import Effect, Layout, Rig


@dataclass(frozen=True, kw_only=True)
class BenchSetup:
    """How a rig is driven, watched, meshed and converted on the bench."""

    drive: Literal["shaker", "force"] = "shaker"
    """``force`` takes the shaker away and applies the generator's volts as newtons, as for a rig that has none."""
    monitors: Sequence[str] = ()
    """Further channels behind the sensors: ``voltage`` of the generator and of the ``amplifier`` (V), coil ``current``
    (A), ``stroke`` of the armature (m)."""
    noise: bool = True
    converter: bool = True
    """False switches them off, for comparisons with exact solutions."""
    layout: Layout | None = None
    """The rig's parts on the bench's own mesh, finer than the rig file's, so that no inference meets its own elements
    again."""
    internal_rate_Hz: float = LIMITS.internal_rate_Hz
    """Least number of physical steps a second."""


class Bench:
    """A rig that streams; see :func:`open_bench`.  It is a :class:`recordings.streams.SampleSource`."""

    def __init__(self, plan: Plan, *, seed: int, sample_rate_Hz: float, setup: BenchSetup) -> None:
        self._plan = plan
        self._rng = np.random.default_rng(seed)
        self._setup = setup
        self._built = build(plan, drive="force" if plan.rig.shaker.ideal else setup.drive)
        self._instruments = list(plan.instruments.values())
        self._channels = tuple(instrument.channel for instrument in self._instruments)
        self._index = 0
        self._rate = 0.0
        self._time_s = 0.0
        self._base = (0, 0)
        self._drift_at_s = 0.0
        self._generator = Generator(1.0 / setup.internal_rate_Hz)
        self._frozen_until = np.zeros(len(self._instruments), np.int64)
        self._held = np.zeros(len(self._instruments), np.float32)
        seeds = np.random.SeedSequence(seed).spawn(len(self._instruments))
        self._noise_rngs = [np.random.Generator(np.random.SFC64(child)) for child in seeds]
        self._hum_phase = [self._rng.uniform(0, 2 * np.pi, len(i.hum)) for i in self._instruments]
        self._states = np.zeros(self._built.common_size)
        self._u = np.zeros(1 + self._built.locals)
        self._y = np.zeros(self._built.locals)
        self._elements = self._built.elements()
        self.set_sample_rate(sample_rate_Hz)

    @property
    def channels(self) -> Sequence[Channel]:
        """The rig's sensors in the file's order, then the monitors that were asked for."""
        return self._channels

    @property
    def sample_rate_Hz(self) -> float:
        """Nominal rate of the samples."""
        return self._rate

    @property
    def built(self) -> Built:
        """The reduced model behind the samples, for tests and for harmonic balance."""
        return self._built

    def set_sample_rate(self, sample_rate_Hz: float) -> float:
        """Choose the nearest rate of :data:`LIMITS.sample_rates_Hz` and return it; the rig's motion goes on."""
        if not np.isfinite(sample_rate_Hz) or sample_rate_Hz <= 0:
            raise ValueError(f"sample rate must be positive, got {sample_rate_Hz}")
        rate = min(LIMITS.sample_rates_Hz, key=lambda r: abs(np.log(r / sample_rate_Hz)))
        if rate == self._rate:
            return rate
        self._base = (self._index, self._time_ns(self._index))
        if self._rate:
            self._store_states()
        self._rate = rate
        self._substeps = max(1, int(np.ceil(self._setup.internal_rate_Hz / rate - 1e-9)))
        self._step_s = 1.0 / (rate * (1.0 + self._plan.clock_error) * self._substeps)
        delays = np.array([i.delay_s for i in self._instruments]) / self._step_s
        slow = self._built.differentiable
        self._taps = decimation_taps(
            self._substeps if self._plan.rig.acquisition.anti_alias else 1,
            delays, differentiate=slow, step_s=self._step_s,
        )  # fmt: skip
        self._history = np.zeros((len(self._instruments), self._taps.shape[1] - 1))
        self._filters = [
            np.array([high_pass_coefficients(c, rate) for c in i.corners_Hz]).reshape(-1, 2) for i in self._instruments
        ]
        self._memory = [np.zeros((len(f), 2)) for f in self._filters]
        self._generator.set(self._generator.excitation, step_s=self._step_s)
        self._load_model()
        return rate

    def set_output(self, excitation: Excitation) -> None:
        """Change the generator's output from the next sample on.

        ValueError if frequency, amplitude or band make no sense.
        """
        low, high = excitation.band_Hz
        if not np.isfinite(excitation.amplitude_V) or not np.isfinite(excitation.frequency_Hz):
            raise ValueError("amplitude and frequency must be finite")
        if excitation.kind in ("random", "multisine") and not 0 < low < high:
            raise ValueError(f"the band must be 0 < low < high, got {low} to {high} Hz")
        self._generator.set(excitation)

    def hit(self, *, peak_N: float, width_s: float, rebound: bool = False) -> None:
        """Hit the place that is driven with a half sine from the next sample on; a hammer that rebounds hits twice."""
        self._generator.add(pulse(peak_N, width_s, self._step_s, rebound=rebound))

    def read(self, count: int) -> SampleBlock:
        """Advance by `count` samples and return them."""
        first = self._index
        signals = np.empty((len(self._instruments), count))
        chunk = max(1, (1 << 13) // self._substeps)  # long enough that a call costs nothing, short enough for the cache
        for start in range(0, count, chunk):
            stop = min(start + chunk, count)
            self._advance(signals[:, start:stop])
        samples, overload = self._convert(signals, first)
        self._index += count
        return SampleBlock(
            device="daq",
            time_ns=self._time_ns(first),
            first_index=first,
            sample_rate_Hz=self._rate,
            samples=samples,
            overload=overload,
        )

    def _time_ns(self, index: int) -> int:
        since, base_ns = self._base
        return base_ns + (round((index - since) / self._rate * 1e9) if self._rate else 0)

    def _advance(self, out: Array) -> None:
        """March one chunk and decimate it into `out`, (channels, count)."""
        self._follow_drift()
        steps = out.shape[1] * self._substeps
        voltage = self._generator.samples(steps)
        internal = np.empty((steps, len(self._instruments)))
        failures = integrate(self._step, self._elements, self._w, self._y, self._u, voltage, internal)
        if failures or not np.isfinite(internal[-1]).all():
            raise ArithmeticError(f"the joint's equations had no solution in {failures} of {steps} steps")
        self._time_s += steps * self._step_s
        stream = np.concatenate([self._history, internal.T], axis=1)
        decimate(stream, self._taps, self._substeps, out)
        self._history = stream[:, stream.shape[1] - self._history.shape[1] :].copy()

    def _follow_drift(self) -> None:
        """Compute the modes anew when the moduli have drifted far enough."""
        rate = max(abs(rate) for rate in (self._plan.moduli_rate_per_s, *(j.rate_per_s for j in self._plan.joints)))
        if rate * (self._time_s - self._drift_at_s) > LIMITS.drift_tolerance:
            self._store_states()
            self._load_model()

    def _store_states(self) -> None:
        """Physical states at the last step, from the poles' (which run one step ahead, less the new input)."""
        c = self._coefficients
        half = len(self._w) // 2
        w = (self._w[:half] + 1j * self._w[half:])[: len(c.decay)]
        at_step = (w - c.Gamma @ self._u) / c.decay + c.G1 @ self._u
        self._states = self._built.to_common(
            (self._poles.to_states @ at_step).real, self._drift_at_s, 1.0 / self._step_s
        )

    def _load_model(self) -> None:
        """Poles and step coefficients at the present time; the motion goes on."""
        self._drift_at_s = self._time_s
        self._poles = self._built.poles(self._time_s, 1.0 / self._step_s, velocities=True)
        self._coefficients = c = coefficients(self._poles, self._step_s)
        states = self._built.from_common(self._states, self._time_s, 1.0 / self._step_s)
        w = c.decay * (self._poles.to_poles @ states - c.G1 @ self._u) + c.Gamma @ self._u
        self._w = packed(w)
        self._step = c.packed(self._built.locals, self._built.auxiliaries)
        self._elements.scale[:] = self._built.scales(self._time_s)

    def _convert(self, signals: Array, first: int) -> tuple[dict[str, Array], dict[str, int]]:
        """Instruments and converter."""
        names = [channel.name for channel in self._channels]
        samples: dict[str, Array] = {}
        overload: dict[str, int] = {}
        count = signals.shape[1]
        noise = np.zeros(count, np.float32)
        for c, i in enumerate(self._instruments):
            signal = i.gain * signals[c]
            for source, factor in i.cross_talk:
                signal = signal + factor * signals[names.index(source)]
            for (frequency_Hz, amplitude), phase in zip(i.hum, self._hum_phase[c], strict=True):
                time_s = np.arange(first, first + count) / (self._rate * (1.0 + self._plan.clock_error))
                signal = signal + amplitude * np.sin(2 * np.pi * frequency_Hz * time_s + phase)
            sigma = i.noise_density * np.sqrt(self._rate / 2) if self._setup.noise else 0.0
            if sigma:
                self._noise_rngs[c].standard_normal(dtype=np.float32, out=noise)
            conversion = Conversion(
                i.limit, i.step, *((i.quantum, i.range) if self._setup.converter else (0.0, np.inf))
            )
            out, overload[names[c]] = convert(signal, noise, sigma, self._filters[c], self._memory[c], conversion)
            self._freeze(c, i, out, first)
            samples[names[c]] = out
        return samples, overload

    def _freeze(self, c: int, i: InstrumentChannel, out: Array, first: int) -> None:
        """Repeat the last value over random stretches, which may reach into the next block."""
        if not i.freezes_per_s or not len(out):
            return
        starts = np.flatnonzero(self._rng.random(len(out)) < i.freezes_per_s / self._rate)
        length = max(2, round(i.freeze_s * self._rate))
        left = min(int(self._frozen_until[c] - first), len(out))
        if left > 0:
            out[:left] = self._held[c]
        for s in starts:
            out[s : s + length] = out[s]
            self._frozen_until[c] = first + s + length
            self._held[c] = out[s]
        if self._frozen_until[c] <= first + len(out):
            self._held[c] = out[-1]


def drive_limits(rig: Rig) -> dict[str, float]:
    """The limits of a rig's amplifier and armature, V, A and m, by the monitor that comes up to each."""
    if rig.shaker.ideal:
        return {}
    current_A = ShakerModel(rig.shaker).current_limit
    limits = {"amplifier": rig.shaker.voltage_limit, "current": current_A, "stroke": rig.shaker.stroke_limit}
    return {name: limit for name, limit in limits.items() if limit}


def assembled(rig: Rig, *, seed: int) -> Rig:
    """One assembly of a rig whose natural frequencies scatter from one to the next."""
    table = rig.natural_frequencies
    if not table.scatter:
        return rig
    errors = np.random.default_rng([seed, LIMITS.bench_assembly]).standard_normal(LIMITS.scattered_modes)
    errors *= table.scatter
    errors[: len(table.offset)] += table.offset
    own = table.model_copy(update={"offset": errors.tolist(), "scatter": 0.0})
    return rig.model_copy(update={"natural_frequencies": own})


def open_bench(
    rig: Rig,
    *,
    preload: str | None = None,
    seed: int = 0,
    effects: Sequence[Effect] = (),
    joint_law: JointLaw | Mapping[str, JointLaw] | None = None,
    sample_rate_Hz: float = 1024.0,
    setup: BenchSetup = BenchSetup(),
) -> Bench:
    """Set up a rig as a source of samples.

    Parameters
    ----------
    rig
        Its own `effect` list acts too, and its `joint.law` where it has one.
    preload
        Name of one of the rig's preloads; the first if not given.
    seed
        Of noise and of everything else that chance decides, as which assembly of the rig it is.
    effects
        Hidden causes, by their contract names.
    joint_law
        Of all joints, or by their names, in place of the rig file's; without either a joint is linear.
    sample_rate_Hz
        The nearest of :data:`LIMITS.sample_rates_Hz` is taken, and none above the highest.
    setup
        How it is driven, watched, meshed and converted.

    Raises
    ------
    ValueError
        If an effect has wrong parameters, there is no such monitor, the joint's law is not passive, or the rate is
        above the converter's highest.
    KeyError
        If there is no such preload.
    """
    if sample_rate_Hz > max(LIMITS.sample_rates_Hz):
        raise ValueError(f"{sample_rate_Hz:g} Hz is above the highest sample rate, {max(LIMITS.sample_rates_Hz):g} Hz")
    plan = planned(
        assembled(rig, seed=seed), preload=preload, effects=effects, joint_law=joint_law, monitors=setup.monitors,
        layout=setup.layout,
    )  # fmt: skip
    return Bench(plan, seed=seed, sample_rate_Hz=sample_rate_Hz, setup=setup)
