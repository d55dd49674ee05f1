"""A mode's frequency and damping over amplitude: read off tables of sweeps, and what such a mode answers."""

from twin.identify.backbones.backbone import BackboneSweep, identify_backbone
from twin.identify.backbones.modal_prediction import ModalResponse, predict_forced, predict_held
