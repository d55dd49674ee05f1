"""Linear models of a rig whose structure, or whose sensors' and shaker's places, an extension changes.

The latest are kept: a fit moves the parameters that leave the structure alone far more often than those that change it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

from twin.identify.extension import Extension
from twin.identify.linear_model import LinearModel, Output, build_linear_model
from twin.rigs import Rig
from twin.structure import Structure, assemble

__all__ = ["ChangedModels", "changed_structure"]

KEPT = 16

Factors = tuple[tuple[str, float], ...]
StructureKey = tuple[Factors, Factors, float, float]
"""Young's moduli and shear ratios of the beams, the clamp's compliance, the layer's gradient."""


class ChangedModels:
    """Builds models of `rig` at `preload`."""

    def __init__(self, rig: Rig, preload: str) -> None:
        self._rig = rig
        self._built = lru_cache(maxsize=KEPT)(partial(_build, rig, preload))
        self._placed = lru_cache(maxsize=KEPT)(self._place)

    def model(self, extension: Extension, outputs: tuple[Output, ...]) -> LinearModel:
        """The model with the extension's beams, clamp, layer and positions; its ports are not yet in it."""
        offset = extension.output_offset_m
        moved = tuple(
            replace(output, position_m=self._within_ends(output.position_m + offset.get(output.channel, 0.0)))
            for output in outputs
        )
        drive_m = self._within_ends(self._rig.drive.position + extension.drive_offset_m)
        structure = (
            tuple(sorted(extension.beam_modulus.items())),
            tuple(sorted(extension.beam_shear_ratio.items())),
            extension.clamp_rad_per_Nm,
            extension.layer_gradient,
        )
        return self._placed(structure, moved, drive_m)

    def _place(self, structure: StructureKey, outputs: tuple[Output, ...], drive_position_m: float) -> LinearModel:
        return self._built(*structure).with_places(outputs, drive_position_m)

    def _within_ends(self, position_m: float) -> float:
        """Nothing sits beyond the structure's ends."""
        return min(max(position_m, 0.0), self._rig.length)


def _build(
    rig: Rig,
    preload: str,
    beam_modulus: Factors,
    beam_shear_ratio: Factors,
    clamp_rad_per_Nm: float,
    layer_gradient: float,
) -> LinearModel:
    changed = Extension(
        beam_modulus=dict(beam_modulus),
        beam_shear_ratio=dict(beam_shear_ratio),
        clamp_rad_per_Nm=clamp_rad_per_Nm,
        layer_gradient=layer_gradient,
    )
    return build_linear_model(rig, [], preload=preload, structure=changed_structure(rig, changed))


def changed_structure(rig: Rig, extension: Extension) -> Structure:
    """The structure assembled with what an extension changes of it."""
    beams = {}
    for name in ("lower", "upper"):
        beam = getattr(rig, name)
        modulus = beam.youngs_modulus * extension.beam_modulus.get(name, 1.0)
        shear = beam.shear_ratio + extension.beam_shear_ratio.get(name, 0.0)
        beams[name] = beam.model_copy(update={"youngs_modulus": modulus, "shear_ratio": shear})
    spring = 1 / extension.clamp_rad_per_Nm if extension.clamp_rad_per_Nm else None
    structure = assemble(rig.model_copy(update=beams), clamp_rotation_stiffness=spring)
    return structure.with_layer_gradient(extension.layer_gradient) if extension.layer_gradient else structure
