"""Rigs as data: what the experimenter believes of a structure, its joints, shaker, sensors and converter."""

from twin.rigs.lap_joint import LapJointRig, Sensor
from twin.rigs.layout import (
    BeamPart,
    Dof,
    Layout,
    Link,
    MatricesPart,
    Place,
    PointMass,
    Support,
    ThinLayer,
    Tie,
)  # fmt: skip
from twin.rigs.preloads import (
    foreign_preload,
    known_preload,
    moduli_at,
    moduli_values,
    nearest_preload,
    preload_name,
    preload_names,
    preload_record,
    recorded_preload,
    with_moduli,
)
from twin.rigs.rig import Rig
from twin.rigs.store import RIG_FILES, load_rig, nominal_rig_file, parse_rig, save_rig
from twin.rigs.structure_rig import StructureRig
from twin.rigs.tables import Effect, LawOfRig, LawTable, LayerLawTable, NamedLaws, PointLaw, Preload, Shaker, Transducer

__all__ = [
    "RIG_FILES", "BeamPart", "Dof", "Effect", "LapJointRig", "LawOfRig", "LawTable", "LayerLawTable", "Layout",
    "Link", "MatricesPart", "NamedLaws", "Place", "PointLaw", "PointMass", "Preload", "Rig", "Sensor", "Shaker",
    "StructureRig", "Support", "ThinLayer", "Tie", "Transducer", "foreign_preload", "known_preload", "load_rig",
    "moduli_at", "moduli_values", "nearest_preload", "nominal_rig_file", "parse_rig", "preload_name",
    "preload_names", "preload_record", "recorded_preload", "save_rig", "with_moduli",
]  # fmt: skip
