"""Whether runs are of one specimen: its resonance at one amplitude is the same in all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.arrays import Array
from twin.checks.agreement import RunBesideModel, agreement_of
from twin.checks.expected import ExpectedResponse
from twin.checks.finding import Finding
from twin.checks.responses import NoiseResponse, SineResponse
from twin.checks.thresholds import DRIFTING, SPECIMEN, SPECIMEN_IN_NOISE
from twin.identify.linear.linear_model import Output

ABOUT = 0.02
"""Relative distance to the resonance within which a step says where it is."""
LOWEST = 5
"""Steps of the smallest amplitudes, which noise is held against."""
BETWEEN = 0.25
"""Logarithm of the distance of two amplitudes over which a resonance is drawn as a line."""
BESIDE = (0.02, 0.08)
"""The same of noise, whose lines at the resonance itself are smeared."""


@dataclass(frozen=True)
class Backbone:
    """Where a resonance is at which amplitude, by the dynamic stiffness at each step."""

    amplitude: Array
    """Displacement (or strain) of the reference channel, rising, (s,)."""
    resonance_Hz: Array
    """(s,)."""

    def apart(self, other: "Backbone") -> float:
        """Median relative distance of another one at the same amplitudes; nan where they share too few."""
        if len(self.amplitude) < 2:
            return np.nan
        here, there = np.log(self.amplitude), np.log(other.amplitude)
        above = np.clip(np.searchsorted(here, there), 1, len(here) - 1)
        shared = (there >= here[above - 1]) & (there <= here[above]) & (here[above] - here[above - 1] < BETWEEN)
        if shared.sum() < 3:
            return np.nan
        expected = np.interp(there[shared], here, self.resonance_Hz)
        return float(np.median(other.resonance_Hz[shared] / expected - 1))

    @property
    def at_rest_Hz(self) -> tuple[float, float]:
        """Least and largest resonance without amplitude: as at the lowest ones, or twice as far as a line goes on."""
        half = len(self.amplitude) // 2
        if half < LOWEST:
            return 0.0, np.inf
        lowest = float(np.median(self.resonance_Hz[:LOWEST]))
        slope = float(np.polyfit(self.amplitude[:half], self.resonance_Hz[:half], 1)[0])
        far = lowest - 2 * slope * float(np.median(self.amplitude[:LOWEST]))
        return min(lowest, far), max(lowest, far)


def backbone_of(sines: Sequence[SineResponse], expected: ExpectedResponse, near_Hz: float) -> Backbone:
    """Of all sweeps about the model's resonance near there that show the motion's level on both its sides."""
    found = []
    for one in sines:
        agreement = agreement_of([], [one], expected)
        if agreement is None or not one.frequency_Hz.min() < near_Hz < one.frequency_Hz.max():
            continue
        output, place = _reference(expected, near_Hz)
        H = one.H[:, place] / agreement.level[place]
        resonance = _resonances(one.frequency_Hz, H, output, expected, place, near_Hz)
        omega = 2 * np.pi * one.frequency_Hz
        amplitude = np.abs(one.H[:, place] * one.force) / omega**output.derivative
        about = np.abs(one.frequency_Hz - resonance) < ABOUT * resonance
        found.append(np.stack([amplitude, resonance])[:, about])
    every = np.concatenate(found, axis=1) if found else np.zeros((2, 0))
    return Backbone(*every[:, np.argsort(every[0])])


def noise_resonance(noise: NoiseResponse, expected: ExpectedResponse, near_Hz: float) -> float:
    """Where noise has that resonance; nan where it has too few lines."""
    output, place = _reference(expected, near_Hz)
    peaks = noise.resonances_Hz[np.abs(noise.resonances_Hz / near_Hz - 1) < BESIDE[1]]
    if not len(peaks):
        return np.nan
    apart = np.abs(noise.frequency_Hz / peaks[0] - 1)
    used = (apart > BESIDE[0]) & (apart < BESIDE[1]) & (noise.coherence[:, place] > 0.9)
    if used.sum() < 4:
        return np.nan
    f = noise.frequency_Hz[used]
    return float(np.median(_resonances(f, noise.H[used, place], output, expected, place, near_Hz)))


def _reference(expected: ExpectedResponse, near_Hz: float) -> tuple[Output, int]:
    place = int(np.argmax(np.abs(expected.H(np.array([near_Hz])))[0]))
    return expected.model.outputs[place], place


def _resonances(f: Array, H: Array, output: Output, expected: ExpectedResponse, place: int, near_Hz: float) -> Array:
    """Resonance (s,) that each frequency's dynamic stiffness tells, beside what the model's other modes add to it."""
    omega = 2 * np.pi * f
    own = expected.H(f)[:, place]
    with np.errstate(divide="ignore", invalid="ignore"):  # where nothing moves there is no resonance near
        stiffness, nominal = (np.real((1j * omega) ** output.derivative / one) * output.sign for one in (H, own))
    x = omega**2 - np.mean(omega**2)
    slope = (x @ nominal) / (x @ x)
    return np.sqrt(np.maximum((2 * np.pi * near_Hz) ** 2 + (nominal - stiffness) / slope, 0)) / (2 * np.pi)


def look_at_specimens(
    learnt: Sequence[RunBesideModel], held_out: Sequence[RunBesideModel], expected: ExpectedResponse
) -> list[Finding]:
    """Runs whose resonances are not those of the learnt sweeps."""
    findings: list[Finding] = []
    learnt_sweeps = [one for seen in learnt for one in seen.sines]
    for near_Hz in expected.resonances_Hz:
        every = backbone_of(learnt_sweeps, expected, near_Hz)
        if not len(every.amplitude):
            continue
        each = [backbone_of([one], expected, near_Hz) for one in learnt_sweeps]
        drift = max((abs(apart) for a, b in pairwise(each) if np.isfinite(apart := a.apart(b))), default=0.0)
        for one in (sine for seen in held_out for sine in seen.sines):
            apart = every.apart(backbone_of([one], expected, near_Hz))
            if abs(apart) > max(SPECIMEN, DRIFTING * drift):
                findings.append(_finding(one.run, f"sweep {one.sweep}", apart, near_Hz, "at the same amplitudes"))
        for record in (noise for seen in (*learnt, *held_out) for noise in seen.noise):
            resonance = noise_resonance(record, expected, near_Hz)
            apart = resonance / float(np.clip(resonance, *every.at_rest_Hz)) - 1
            if abs(apart) > SPECIMEN_IN_NOISE:
                findings.append(_finding(record.run, f"noise {record.sweep}", apart, near_Hz, "at small amplitudes"))
    return findings


def _finding(run: str, what: str, apart: float, near_Hz: float, where: str) -> Finding:
    found = f"{what} has it {apart:+.2%} off: another specimen, or a change since?"
    return Finding(run, "", "specimen", f"the learnt sweeps' resonance near {near_Hz:.4g} Hz {where}", found, "told")
