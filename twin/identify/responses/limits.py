"""Numbers by which measured frequency responses are judged."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    reproduced: float = 0.01
    """Relative error of a line that no coherence shows: labs reproduce a response to a per cent when nothing is
    touched (calibrations of two sensors, ISO 16063-21; leakage, cables)."""
    leakage: float = 0.5
    """Of a response's bend from line to line, over itself, the share that windows and interpolation leave as error."""
    window: int = 8
    """Lines to each side over which a response is a ratio of polynomials: so few that one resonance is in them."""
    coherent: float = 0.05
    """Coherence below which a line says nothing."""
    averages: int = 5
    """Fewest from which a coherence tells the noise: its bias is one over them."""
    noisiest: float = 0.3
    """Relative standard deviation of a line beyond which its logarithm says nothing."""
    prominence: float = 0.3
    """Of a resonance or an antiresonance in log10 of the magnitude: a factor of two."""
    near: float = 0.02
    """Distance of a geometry's node from a sensor of the rig, over the structure's size, up to which they are one."""
    shape: float = 0.05
    """Relative error of each mode's share in each response that a sound rig has: places to a millimetre or two,
    sensors that lean and load, a mesh's own; the part of it that no parameter of the model explains."""
    shape_again: float = 0.015
    """The same where the rig file says what the sensor was identified to show: mounted once more."""
    scatter: float = 5e-4
    """Least relative scatter of natural frequencies from one assembly to the next: two kelvin, and the same torque."""
    known_cases: int = 3
    """Fewest responses of one state from which a scatter is told."""


LIMITS = Limits()
