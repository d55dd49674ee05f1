"""Modes from frequency responses alone, without a model of the structure."""

from twin.identify.modes.fit import ModalFit, Mode, fit_modes
from twin.identify.modes.rational import ChartPole
