"""Rigs as data: what the experimenter believes of a structure, its joint, shaker, sensors and converter."""

from twin.rigs.preloads import foreign_preload, known_preload, nearest_preload, preload_record, recorded_preload
from twin.rigs.rig import Effect, Joint, LawTable, LayerLawTable, Rig, Sensor
from twin.rigs.store import RIG_FILES, believed_rig_file, load_rig, parse_rig, save_rig

__all__ = [
    "RIG_FILES",
    "Effect",
    "Joint",
    "LawTable",
    "LayerLawTable",
    "Rig",
    "Sensor",
    "believed_rig_file",
    "foreign_preload",
    "known_preload",
    "load_rig",
    "nearest_preload",
    "parse_rig",
    "preload_record",
    "recorded_preload",
    "save_rig",
]
