"""Linear models of a rig whose structure, or whose sensors' and shaker's places, an extension changes.

The latest are kept: a fit moves the parameters that leave structure and ports alone far more often than the others.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from twin.arrays import Array
from twin.identify.linear.linear_model import LinearModel, Output, build_linear_model
from twin.identify.model_modification import ModelModification, StructureKey
from twin.rigs import Place, Rig
from twin.structure import Structure, assemble

KEPT = 16


class ChangedModels:
    """Builds models of `rig` at `preload`."""

    def __init__(self, rig: Rig, preload: str) -> None:
        self._rig, self._preload, self._layout = rig, preload, rig.layout()
        self._built = lru_cache(maxsize=KEPT)(self._build)
        self._placed = lru_cache(maxsize=KEPT)(self._place)
        self._ported = lru_cache(maxsize=KEPT)(_ported)

    def model(self, modification: ModelModification, outputs: tuple[Output, ...]) -> LinearModel:
        """The model with the extension's beams, clamp, layer and positions; its ports are not yet in it."""
        offset, off, layout = modification.output_offset_m, modification.drive_offset_m, self._layout
        moved = tuple(
            replace(o, place=layout.moved(o.place, offset[o.channel])) if o.channel in offset else o for o in outputs
        )
        drives = tuple(layout.moved(place, off.get(name, 0.0)) for name, place in self._rig.drives.items())
        return self._placed(modification.structure, moved, drives)

    def ported(self, model: LinearModel, extra: Array, points: Array) -> tuple[LinearModel, LinearModel]:
        """A model with extra ports, rows (p, n), and the same with points behind all others."""
        return self._ported(model, *((len(rows), rows.tobytes()) for rows in (extra, points)))

    def _place(self, structure: StructureKey, outputs: tuple[Output, ...], drives: tuple[Place, ...]) -> LinearModel:
        return self._built(structure).with_places(outputs, drives)

    def _build(self, structure: StructureKey) -> LinearModel:
        changed = changed_structure(self._rig, ModelModification.of_structure(structure))
        return build_linear_model(self._rig, [], preload=self._preload, structure=changed)


def _ported(model: LinearModel, *packed: tuple[int, bytes]) -> tuple[LinearModel, LinearModel]:
    extra, points = (np.frombuffer(rows).reshape(count, model.structure.size) for count, rows in packed)
    found = model.with_ports(extra)
    return found, found.with_points(points)


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
