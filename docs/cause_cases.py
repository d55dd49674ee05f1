"""Hide each cause once, diagnose it, and keep what came: ``docs/causes/NAME.json`` and ``NAME.png``.

python docs/cause_cases.py                      every cause whose case is of another version, some minutes each
python docs/cause_cases.py added-mass clipping  these, whatever is there
"""

from __future__ import annotations

import json
import sys
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import twin
from recordings import Run, RunWriter
from twin.bench import HiddenCase, draw_case
from twin.cause_registry import NAMES
from twin.demo import BROADBAND, SWEEPS, broadband, planned_sweeps, resonance
from twin.identify.spectra.spectrum import broadband_records, h1
from twin.procedures import DirectAcquisition, Procedure, run_procedure
from twin.views.curves import stepped_sweeps
from twin.views.drawing import dressed, legend, panels
from twin.views.receptance import per_force_label
from twin.views.style import unit_text

FOLDER = Path(__file__).parent / "causes"
RIG = "steel-lap-joint"
SEED = 2611
"""Of what no experimenter knows of the rig, of each cause's size, and of the noise."""
AMPLITUDES_N = [1.5, 6.0]
NOISE_s = 30.0
TOO_SHORT_s = 0.3
"""Wait before each step of the sweep that is not waited for."""
SHOWN_s = 0.12
WITH, WITHOUT = "#0072b2", "#9a9a9a"


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """The runs of one rig: noise, and sweeps through the first resonance."""

    noise: Path
    sweeps: tuple[Path, ...]


def drawn(cause: str) -> HiddenCase:
    """The rig as it is, the same for every cause, with `cause` of normal size in it; ``none`` for nothing."""
    rig = twin.load_rig(RIG).file
    truth = draw_case(np.random.default_rng(SEED), rig=rig, causes=["none"])
    rng = np.random.default_rng([SEED, zlib.crc32(cause.encode())])
    effects = draw_case(rng, rig=rig, causes=[cause]).effects
    if cause == "unsettled-dwell":
        sweep = f"{AMPLITUDES_N[-1]:g}N-up"
        effects = tuple(effect.model_copy(update={"parameters": {"sweep": sweep}}) for effect in effects)
    return replace(truth, effects=effects)


def recorded(case: HiddenCase, folder: Path) -> Recorded:
    """Record a case sample by sample; shorter than the demonstration does, and with the waits where a drift asks."""
    folder.mkdir(parents=True, exist_ok=True)
    causes = {effect.cause for effect in case.effects}
    rng = np.random.default_rng([SEED, len(causes)])
    store = {"store": "all"} if causes & {"preload-loss", "temperature-drift"} else {}

    def record(name: str, procedure: Procedure, **change: Any) -> Path:
        acquisition = DirectAcquisition(case.open_bench(seed=int(rng.integers(2**31))))
        planned = procedure.model_copy(update={**store, **change})
        info = {"source": "simulated", "rig": RIG, "procedure": planned.procedure, "stored": planned.store}
        with RunWriter(folder / name, info=info, channels=acquisition.channels, overwrite=True) as writer:
            run_procedure(planned, acquisition, writer)
        return folder / name

    noise = record(BROADBAND, broadband(), duration=NOISE_s)
    rig = twin.load_rig(RIG).file
    sweep = planned_sweeps(rig, resonance(twin.load_run(noise).run, rig))[SWEEPS]
    assert sweep.frequencies is not None
    sweep = sweep.model_copy(update={"frequencies": sweep.frequencies[::2], "amplitudes": AMPLITUDES_N})
    if "unsettled-dwell" not in causes:
        return Recorded(noise=noise, sweeps=(record(SWEEPS, sweep),))
    hurried = sweep.settle.model_copy(update={"maximum": TOO_SHORT_s})
    return Recorded(
        noise=noise,
        sweeps=(
            record("slow.mcap", sweep, amplitudes=AMPLITUDES_N[:1]),
            record("hurried.mcap", sweep, amplitudes=AMPLITUDES_N[1:], settle=hurried),
        ),
    )


def diagnosed(runs: Recorded) -> dict[str, Any]:
    """What the diagnosis says of the runs, and what it weighed."""
    found = twin.load_rig(RIG).diagnose([runs.noise, *runs.sweeps]).diagnosis
    told = found.to_dict()
    (first, *_) = found.search.stages
    scored: dict[str, float] = {}
    for score in first.scores:
        scored[score.hypothesis.cause.name] = max(scored.get(score.hypothesis.cause.name, -np.inf), score.log_bayes)
    return {
        "verdict": told["verdict"],
        "answer": told["answer"],
        "set_95": told["set_95"],
        "before": told["misfit"]["chi2_per_dof"],
        "after": told["misfit"]["after"],
        "scored": {name: round(gain, 1) for name, gain in scored.items() if gain > 0},
        "fitted": [
            {
                "causes": [hypothesis.key for hypothesis in model.hypotheses],
                "gain": round(model.log_evidence - first.before.log_evidence, 1),
            }
            for model in first.rivals
        ],
    }


def figure(cause: str, runs: Recorded, sound: Recorded) -> Figure:
    """The recordings with the cause and without it: response to noise, sweeps, and samples of one channel."""
    parameters = drawn(cause).effects[0].parameters
    channel = str(parameters.get("channel", "acc2"))
    shown = channel if channel != "force" else "acc2"
    drawing, axes = panels(2, 2, height_in=5.6)
    for recorded_, colour, label in ((sound, WITHOUT, f"without {cause}"), (runs, WITH, f"with {cause}")):
        noise = twin.load_run(recorded_.noise).run
        (record, *_) = broadband_records(noise)
        spectrum = h1(record, force="force", resolution_Hz=0.5)
        inside = (spectrum.frequency_Hz > 5) & (spectrum.frequency_Hz < 1000)
        response = spectrum.H[shown][inside]
        axes[0, 0].semilogy(spectrum.frequency_Hz[inside], np.abs(response), color=colour, lw=1, label=label)
        turned = (np.degrees(np.angle(response)) + 270) % 360 - 270
        axes[1, 0].plot(spectrum.frequency_Hz[inside], turned, color=colour, lw=0.8)
        for path in recorded_.sweeps:
            run = twin.load_run(path).run
            for number, sweep in enumerate(stepped_sweeps(run)):
                style = {"color": colour, "alpha": 1.0 if number == 0 else 0.6, "marker": ".", "lw": 1}
                axes[0, 1].plot(sweep.frequency_Hz, sweep.receptance[shown], **style)
        _samples(axes[1, 1], run, channel, colour)
    dressed(axes[0, 0], title="response to noise", ylabel=f"|{shown}/force|, 1/kg")
    dressed(axes[1, 0], xlabel="frequency, Hz", ylabel="phase, degrees")
    dressed(
        axes[0, 1], title="sweeps at 1.5 and 6 N (paler)", xlabel="frequency, Hz",
        ylabel=per_force_label(shown, run.channels[shown].quantity),
    )  # fmt: skip
    dressed(axes[1, 1], title="samples", xlabel="time, s", ylabel=f"{channel}, {unit_text(run.channels[channel].unit)}")
    legend(drawing)
    return drawing


def _samples(axes: Axes, run: Run, channel: str, colour: str) -> None:
    """A stretch about where a channel repeats one value longest, else about its largest."""
    device = run.device_of(channel)
    x = np.nan_to_num(device.values[channel].astype(float))
    ends = np.flatnonzero(np.diff(x, prepend=np.nan, append=np.nan) != 0)
    longest = int(np.argmax(np.diff(ends)))
    repeats = int(np.diff(ends)[longest])
    middle = int(ends[longest]) + repeats // 2 if repeats > 3 else int(np.argmax(np.abs(x)))
    half = round(SHOWN_s / 2 * device.sample_rate_Hz)
    part = x[max(0, middle - half) : middle + half]
    axes.plot(np.arange(len(part)) / device.sample_rate_Hz, part, color=colour, lw=1, marker=".", ms=3)


def main(causes: Sequence[str]) -> None:
    """Make cases, all that this version lacks if none are named: every picture first, then the diagnoses."""
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        sound = recorded(drawn("none"), Path(temporary) / "none")
        runs = {}
        for cause in causes or [name for name in NAMES if "verdict" not in kept(name)]:
            runs[cause] = recorded(drawn(cause), Path(temporary) / cause)
            figure(cause, runs[cause], sound).savefig(FOLDER / f"{cause}.png", dpi=70, facecolor="white")
            keep(cause, {})
        for cause, recordings in runs.items():
            keep(cause, diagnosed(recordings))


def keep(cause: str, told: Mapping[str, Any]) -> None:
    """Write what was hidden, and what the diagnosis told of it."""
    (effect,) = drawn(cause).effects
    case = {"version": version("virtual-test-rig"), "hidden": dict(effect.parameters), **told}
    text = json.dumps(case, indent=1, ensure_ascii=False) + "\n"
    (FOLDER / f"{cause}.json").write_text(text, encoding="utf-8")


def kept(cause: str) -> dict[str, Any]:
    """The case of a cause that is kept; nothing if it is of another version."""
    path = FOLDER / f"{cause}.json"
    case: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return case if case.get("version") == version("virtual-test-rig") else {}


if __name__ == "__main__":
    main(sys.argv[1:])
