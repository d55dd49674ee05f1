"""The papers' printed tables: one TOML file a study, read into arrays."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from recordings.toml_input import read_toml


class Condition(BaseModel):
    """What a paper prints of one condition: frequencies in Hz, moduli in N/m2."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    measured: list[float]
    published_model: list[float] = []
    printed_error_percent: list[float] = []
    published: dict[str, float] = {}


class Law(BaseModel):
    """Coefficients of g1 and g2 (the hybrid paper's F1, F2) over the response amplitude, constant first: N/m2, ..."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    softening: list[float]
    loss: list[float]


class Sweeps(BaseModel):
    """Stepped sines of a paper, and the laws by preload that the bench makes them with; SI units.

    `published_residual_percent` is by preload and force, as in ``9Nm, 5 N``.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    channel: str
    forces_N: list[float]
    largest_amplitude_m: float
    law: dict[str, Law]
    note: list[str] = []
    published_residual_percent: dict[str, float] = {}


class Study(BaseModel):
    """A paper's table with its source, what it states besides, and what is odd in it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str
    source: str
    note: list[str] = []
    stated: dict[str, float] = {}
    condition: dict[str, Condition]
    sweeps: Sweeps | None = None


def load_study(name: str) -> Study:
    """The shipped tables of one study, such as ``steel-lap-joint``."""
    return read_toml(Path(__file__).parent / f"{name}.toml", Study)


def percent_error(measured: list[float] | NDArray[np.float64], model: list[float] | NDArray[np.float64]) -> list[float]:
    """100 (measured - model) / measured, the papers' sign."""
    f = np.asarray(measured, float)
    return (100 * (f - np.asarray(model, float)) / f).tolist()
