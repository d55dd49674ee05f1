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
    # evidence.py
    evidence_lowest: float = 0.3
    """Of the band, over the first natural frequency: below it a structure that is held hardly answers."""
    # following.py
    following_frequency: float = 0.02
    following_damping: float = 0.7
    following_shown: float = 0.4
    """Standard deviations beforehand, about the resonances that show: of frequencies, and of the logarithms of damping
    ratios and of what is shown of each mode."""
    following_loose: float = 0.1
    following_tight: float = 0.01
    """Relative model errors with which the fit begins and ends."""
    largest_step: tuple[float, float, float] = 0.005, 0.5, 0.5
    """Of the same in one iteration."""
    # matching.py
    matching_along: float = 0.9
    """Cosine from which on two directions are one."""
    # modal_tables.py
    looked_at: int = 12
    """First modes of the model among which a measured one is looked for."""
    modal_tables_rounds: int = 3
    """Of pairing and of updating, one from the other."""
    # parameters.py
    parameters_modulus: float = 0.05
    parameters_density: float = 0.01
    parameters_spring: float = 0.7
    parameters_joint: float = 0.3
    """Standard deviations of logarithms beforehand: a data sheet's modulus, a weighed part's density, a spring that was
    guessed to a factor of two, a joint."""
    parameters_clamp: float = 0.03
    """The same of a clamp's rotation per moment, over the beam's own, L / EI; none is the likeliest."""
    least_clamp: float = 1e-6
    """Below it a clamp is rigid."""
    # reduction.py
    reduction_orders: tuple[int, int] = (2, 1)
    """Of the polynomials above and below."""
    # updating.py
    updating_model: float = 1e-3
    """Relative error of a natural frequency that a good model keeps when all its numbers are right."""
    updating_rounds: int = 2
    """Of following the resonances and of updating, one from the other."""
    updating_shape: float = 0.05
    updating_gain: float = 0.05
    """Relative error of a modal constant of a good model, and of a sensor's sensitivity beside the force's."""
    updating_told: float = 0.7
    """Standard deviation over the one beforehand up to which the data tell a number."""


LIMITS = Limits()
