"""Runs for the views, and what an .rrd holds, read back through rerun's own reader."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from needed import program
from rerun.chunk import RrdReader

from recordings import Channel, DeviceSamples, Event, Run, SampleBlock, Step, StepState
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FittedModel
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.gauss_newton import Solution
from twin.identify.residuals.error_model import SOUND

RATE_Hz = 1024.0
NATURAL_Hz, RATIO, STIFFNESS = 25.0, 0.02, 2000.0
FREQUENCIES_Hz = (23.0, 24.0, 25.0, 26.0)
LEVELS_N = (1.0, 2.0)
CHANNELS = (
    Channel(name="force", quantity="force", unit="N", position_m=0.05, range=50.0),
    Channel(name="acc1", quantity="acceleration", unit="m/s^2", position_m=0.3, range=490.0),
)
STEP = 1024


def sdof_receptance(frequency_Hz: float) -> complex:
    """Displacement per force of one degree of freedom, m/N."""
    ratio = frequency_Hz / NATURAL_Hz
    return 1.0 / (STIFFNESS * (1 - ratio**2 + 2j * RATIO * ratio))


def sdof_run() -> Run:
    """Two sweeps over a resonance, each step one second long, with a second harmonic of 1 % in the response."""
    force, response, steps = [], [], []
    t = np.arange(STEP) / RATE_Hz
    for level in LEVELS_N:
        for index, frequency in enumerate(FREQUENCIES_Hz):
            at = round(len(force) * STEP / RATE_Hz * 1e9)
            steps.append(_step(at, level, index, frequency, StepState.MEASURING))
            omega = 2 * np.pi * frequency
            acceleration = -(omega**2) * sdof_receptance(frequency) * level
            wave = np.exp(1j * omega * t)
            force.append(level * wave.real)
            response.append((acceleration * wave + 0.01 * abs(acceleration) * wave**2).real)
        end = round(len(force) * STEP / RATE_Hz * 1e9) - 1
        steps.append(_step(end, level, index, frequency, StepState.DONE))
    device = DeviceSamples(
        device="daq",
        sample_rate_Hz=RATE_Hz,
        values={"force": np.concatenate(force).astype(np.float32), "acc1": np.concatenate(response).astype(np.float32)},
        block_start=np.array([0]),
        block_time_ns=np.array([0]),
        overload={},
    )
    return Run(
        path="sweeps.mcap",
        info={"rig": "one resonance", "source": "simulated"},
        channels={channel.name: channel for channel in CHANNELS},
        devices={"daq": device},
        steps=tuple(steps),
        events=(Event(time_ns=10**9, source="acc1", kind="overload", detail="3 samples"),),
    )


def _step(time_ns: int, level: float, index: int, frequency_Hz: float, state: StepState) -> Step:
    return Step(
        time_ns=time_ns, sweep=f"{level:g}N-up", index=index, frequency_Hz=frequency_Hz, target_channel="force",
        target_amplitude=level, state=state,
    )  # fmt: skip


def write_mcap(run: Run, path: Path) -> Path:
    """The run as a file."""
    from recordings import RunWriter

    device = run.devices["daq"]
    with RunWriter(path, info=dict(run.info), channels=list(run.channels.values()), overwrite=True) as writer:
        for step in run.steps:
            writer.write_step(step)
        for start in range(0, len(device), STEP):
            writer.write_block(
                SampleBlock(
                    device="daq", time_ns=round(start / RATE_Hz * 1e9), first_index=start, sample_rate_Hz=RATE_Hz,
                    samples={name: values[start : start + STEP] for name, values in device.values.items()},
                )
            )  # fmt: skip
    return path


def verify(path: Path) -> None:
    """`rerun rrd verify` finds nothing wrong."""
    done = subprocess.run([program("rerun"), "rrd", "verify", str(path)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def columns(path: Path) -> dict[str, dict[str, list[Any]]]:
    """Entity -> component -> its rows in the order of the file."""
    found: dict[str, dict[str, list[Any]]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        entity = found.setdefault(str(chunk.entity_path).replace("\\", ""), {})
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            entity.setdefault(name, []).extend(_plain(column).to_pylist())
    return found


def _plain(column: pa.Array) -> pa.Array:
    """Times and durations as whole nanoseconds: Python's own have none, and pandas' are not at hand everywhere."""
    temporal = pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type)
    return column.cast(pa.int64()) if temporal else column


def value_at(ticks: dict[str, list[Any]], place: float, *, axis: int = 1, log: bool = False) -> float:
    """The value of a place in a chart, from the latest printed ticks of an axis alone."""
    values = np.array([_number(text) for text in ticks["Points2D:labels"][-1]])
    positions = np.array(ticks["Points2D:positions"][-1], float)
    # A tick's label hangs beside its line: left of the frame by 38, and 12 higher, for text of the usual size.
    places = positions[:, 1] - positions[:, 0] * 12 / 38 if axis == 1 else positions[:, 0]
    slope, offset = np.polyfit(places, np.log(values) if log else values, 1)
    value = float(slope * place + offset)
    return float(np.exp(value)) if log else value


def _number(text: str) -> float:
    """What a tick says, such as ``0.2`` or ``10⁻³``."""
    plain = text.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(text) if plain == text else 10.0 ** int(plain.removeprefix("10"))


def view_origins(path: Path) -> list[str]:
    """Where the views of the file's own blueprint look."""
    reader = RrdReader(path)
    origins = []
    for entry in reader.blueprints():
        for chunk in reader.stream(store=entry):
            batch = chunk.to_record_batch()
            for name, column in zip(batch.schema.names, batch.columns, strict=True):
                if name == "ViewBlueprint:space_origin":
                    origins += [str(row[0]) for row in column.to_pylist() if row]
    return origins


def fitted_model(
    baseline: BaselineParameters, hypotheses: tuple[CauseHypothesis, ...], history: tuple[float, ...]
) -> FittedModel:
    """A fit that ended at these unknowns, its chi2 by turns."""
    x = baseline.vector
    std = np.concatenate([np.full(14, 1e-3), np.full(len(x) - 14, 1e5)])
    solution = Solution(x, history[-1], 0.0, np.diag(1 / std**2), np.zeros(4), np.zeros((4, len(x))), history)
    return FittedModel(hypotheses, baseline, SOUND, solution, 0.0, 100)
