"""A rig without a mesh, ``kind = "modal"``: one measured mode whose frequency and damping depend on its amplitude."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from recordings.numbers import Finite, NonNegative, Positive
from recordings.toml_input import Name, Table
from twin.rigs.tables import check_knots


class LevelFit(Table):
    """One sweep of the identification: its mode by itself, and by the law of all other sweeps."""

    level: str
    amplitude_m_per_s2: Positive
    frequency_Hz: Positive
    damping_ratio: Positive
    left_out_frequency_error_Hz: Finite
    left_out_force_rms: NonNegative
    shifted: bool
    """Whether this sweep disagrees with the smooth law of the others by more than their own scatter."""


class ModalLaw(Table):
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
        over = ("frequency_Hz", "damping_ratio", "frequency_std_Hz", "damping_relative_std")
        check_knots(self, "amplitude_m_per_s2", *over)
        return self


class ModalRig(Table):
    """A measured structure near one mode: before identification its name and channel, after it its law."""

    kind: Literal["modal"]
    name: Name
    source: str = ""
    channel: str = "acc1"
    """The response whose amplitude the law depends on."""
    law: ModalLaw | None = None
    level: list[LevelFit] = Field(default=[])
    note: list[str] = Field(default=[])
