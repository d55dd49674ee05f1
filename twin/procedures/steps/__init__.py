"""One step of a sine procedure: amplitude and phase controlled, settling judged, transients stopped, then measured."""

from twin.procedures.steps.sine_step import run_sine_step
from twin.procedures.steps.wait import SineStep
