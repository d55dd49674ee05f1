"""Linear models of a rig whose structure, or whose sensors' and shaker's places, an extension changes.

The latest are kept: a fit moves the parameters that leave the structure alone far more often than those that change it.
"""

from dataclasses import replace
from functools import lru_cache, partial

from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model
from twin.identify.model_modification import ModelModification
from twin.rigs import Place, Rig
from twin.structure import Structure, assemble

KEPT = 16

Factors = tuple[tuple[str, float], ...]
StructureKey = tuple[Factors, ...]
"""Young's moduli and shear ratios of the beams, the supports' compliance, the layers' gradients."""


class ChangedModels:
    """Builds models of `rig` at `preload`."""

    def __init__(self, rig: Rig, preload: str) -> None:
        self._rig, self._layout = rig, rig.layout()
        self._built = lru_cache(maxsize=KEPT)(partial(_build, rig, preload))
        self._placed = lru_cache(maxsize=KEPT)(self._place)

    def model(self, modification: ModelModification, outputs: tuple[Output, ...]) -> LinearModel:
        """The model with the extension's beams, clamp, layer and positions; its ports are not yet in it."""
        offset = modification.output_offset_m
        layout = self._layout
        moved = tuple(
            replace(output, place=layout.moved(output.place, offset[output.channel]))
            if output.channel in offset else output
            for output in outputs
        )  # fmt: skip
        off = modification.drive_offset_m
        drives = tuple(layout.moved(place, off.get(name, 0.0)) for name, place in self._rig.drives.items())
        structure = tuple(
            tuple(sorted(changed.items()))
            for changed in (
                modification.beam_modulus,
                modification.beam_shear_ratio,
                modification.clamp_rad_per_Nm,
                modification.layer_gradient,
            )
        )
        return self._placed(structure, moved, drives)

    def _place(self, structure: StructureKey, outputs: tuple[Output, ...], drives: tuple[Place, ...]) -> LinearModel:
        return self._built(*structure).with_places(outputs, drives)


def _build(
    rig: Rig,
    preload: str,
    beam_modulus: Factors,
    beam_shear_ratio: Factors,
    clamp_rad_per_Nm: Factors,
    layer_gradient: Factors,
) -> LinearModel:
    changed = ModelModification(
        beam_modulus=dict(beam_modulus),
        beam_shear_ratio=dict(beam_shear_ratio),
        clamp_rad_per_Nm=dict(clamp_rad_per_Nm),
        layer_gradient=dict(layer_gradient),
    )
    return build_linear_model(rig, [], preload=preload, structure=changed_structure(rig, changed))


def changed_structure(rig: Rig, modification: ModelModification) -> Structure:
    """The structure assembled with what an extension changes of it."""
    layout = rig.layout()
    for beam in layout.beams:
        modulus = beam.youngs_modulus * modification.beam_modulus.get(beam.name, 1.0)
        shear = beam.shear_ratio + modification.beam_shear_ratio.get(beam.name, 0.0)
        layout = layout.with_beam(beam.name, youngs_modulus=modulus, shear_ratio=shear)
    for part, rad_per_Nm in modification.clamp_rad_per_Nm.items():
        layout = layout.with_yielding_supports(rad_per_Nm, part=part)
    structure = assemble(rig, layout=layout)
    for number, joint in enumerate(structure.joints):
        if joint.name in modification.layer_gradient:
            structure = structure.with_gradient(modification.layer_gradient[joint.name], joint=number)
    return structure
