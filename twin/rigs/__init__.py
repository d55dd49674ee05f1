"""Rigs as data: what the experimenter believes of a structure, its joint, shaker, sensors and converter."""

from twin.rigs.rig import Effect, Joint, LawTable, Rig, Sensor
from twin.rigs.store import RIG_FILES, load_rig, parse_rig, save_rig

__all__ = ["RIG_FILES", "Effect", "Joint", "LawTable", "Rig", "Sensor", "load_rig", "parse_rig", "save_rig"]
