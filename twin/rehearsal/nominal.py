"""What is assumed of a rig that is rehearsed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from twin.bench import drive_limits
from twin.procedures.limits import LIMITS
from twin.rigs import Rig, nominal_rig_file, preload_record
from twin.structure.modelled_rig import modelled_rig
from twin.structure.plausibility import unlikely_units


@dataclass(frozen=True, kw_only=True)
class NominalRig:
    """What is assumed of the rig beside its samples, and what the recording should say of it."""

    rig_name: str = ""
    rig_file: bytes = b""
    """For the ``run`` record and its attachment."""
    preload: Mapping[str, str] = field(default_factory=dict)
    """``preload_N`` or ``preload_Nm`` of the ``run`` record, where known."""
    damping_ratio: float = LIMITS.usual_damping_ratio
    """Of the least damped mode."""
    bits: int | None = None
    """The converter's."""
    drive_limits: Mapping[str, float] = field(default_factory=dict)
    """By the channel that shows each."""
    branches: Sequence[Mapping[str, Any]] = ()
    """Predicted curves, as :func:`twin.rehearsal.branch_tables` gives them: where they fold, a sweep jumps."""
    implausible: Sequence[str] = ()
    """What the rig's file is unlikely to mean."""
    modes: Sequence[tuple[float, float]] = ()
    """Natural frequencies of the file's structure, Hz, with their damping ratios."""

    @classmethod
    def of(cls, rig: Rig, *, preload: str, branches: Sequence[Mapping[str, Any]] = ()) -> NominalRig:
        """What the rig's file says, at one of its preloads, and the branches predicted from it."""
        return cls(
            rig_name=rig.name,
            rig_file=nominal_rig_file(rig),
            preload=preload_record(preload),
            damping_ratio=min(rig.damping.modal_ratio),
            bits=rig.acquisition.bits,
            drive_limits=drive_limits(rig),
            branches=branches,
            implausible=unlikely_units(rig),
            modes=_modes(rig, preload),
        )


def _modes(rig: Rig, preload: str) -> tuple[tuple[float, float], ...]:
    ratios, modes = rig.damping.modal_ratio, modelled_rig(rig, preload=preload or None).modes
    return tuple((float(f), ratios[min(number, len(ratios) - 1)]) for number, f in enumerate(modes.frequency_Hz))
