"""A rig without a mesh, ``kind = "modal"``: one measured mode whose frequency and damping depend on its amplitude."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, model_validator

from recordings.toml_input import read_toml

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class LevelFit(_Table):
    """One sweep of the identification: its mode by itself, and by the law of all other sweeps."""

    level: str
    amplitude_m_per_s2: Positive
    frequency_Hz: Positive
    damping_ratio: Positive
    left_out_frequency_error_Hz: Finite
    left_out_force_rms: NonNegative
    shifted: bool
    """Whether this sweep disagrees with the smooth law of the others by more than their own scatter."""


class ModalLaw(_Table):
    """Amplitude-dependent mode, as receptance from the force to the response.

    It reads ::

        x / F = exp(j phase) [ 1 / (m (W^2 - w^2 + 2 j zeta W^2)) + residual / (m W0^2) ]

    W = 2 pi frequency_Hz and zeta follow the response's acceleration amplitude between knots by monotone cubics, and
    stay constant beyond them; W0 belongs to the first knot.  Standard deviations include how far whole sweeps stray
    from any smooth law.
    """

    modal_mass_kg: Positive
    residual: Finite
    phase_rad: Finite
    amplitude_m_per_s2: list[NonNegative] = Field(min_length=2, max_length=500)
    frequency_Hz: list[Positive]
    damping_ratio: list[Positive]
    frequency_std_Hz: list[NonNegative]
    damping_relative_std: list[NonNegative]
    force_relative_std: NonNegative

    @model_validator(mode="after")
    def _knots(self) -> ModalLaw:
        a = self.amplitude_m_per_s2
        if any(later <= earlier for earlier, later in itertools.pairwise(a)):
            raise ValueError("amplitude_m_per_s2 must increase")
        for name in ("frequency_Hz", "damping_ratio", "frequency_std_Hz", "damping_relative_std"):
            if len(getattr(self, name)) != len(a):
                raise ValueError(f"{name} must have as many entries as amplitude_m_per_s2")
        return self


class ModalRig(_Table):
    """A measured structure near one mode: before identification its name and channel, after it its law."""

    kind: Literal["modal"]
    name: Annotated[str, Field(min_length=1, max_length=64)]
    source: str = ""
    channel: str = "acc1"
    """The response whose amplitude the law depends on."""
    law: ModalLaw | None = None
    level: list[LevelFit] = []
    note: list[str] = []


MODAL_RIG_FILES = {path.stem: path for path in sorted((Path(__file__).parent / "modal_rigs").glob("*.toml"))}
"""The shipped modal rigs by name."""


def is_modal_rig(name_or_path: str | Path) -> bool:
    """Whether this names a shipped modal rig, or a TOML file with ``kind = "modal"``."""
    if str(name_or_path) in MODAL_RIG_FILES:
        return True
    path = Path(name_or_path)
    return path.is_file() and read_toml(path, _Kind).kind == "modal"


def load_modal_rig(name_or_path: str | Path) -> ModalRig:
    """A shipped modal rig by name, a modal rig's file, or an identified modal model.

    Raises
    ------
    InputError
        If the file cannot be read or does not describe a modal rig.
    """
    return read_toml(MODAL_RIG_FILES.get(str(name_or_path), Path(name_or_path)), ModalRig)


def save_modal_rig(rig: ModalRig, path: Path) -> None:
    """Write `rig` as TOML that :func:`load_modal_rig` reads back equal."""
    path.write_text(tomli_w.dumps(rig.model_dump(exclude_none=True)), encoding="utf-8")


class _Kind(BaseModel):
    """Any rig's first question."""

    model_config = ConfigDict(extra="ignore")
    kind: str = "lap-joint"
