"""What a rehearsal decides by, with where each figure comes from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Figures of the rules in the files that the comments name."""

    # bands.py
    bands_fewest: int = 3
    """Steps about a resonance: fewer, as a coarse grid has at low frequencies, belong to the next one."""
    bands_sunk: float = 0.5
    """Of the lower of two peaks: between them the response must fall below, else both are one resonance (half: 6
    dB)."""

    # checks/drop_out.py
    drop_out_constants: float = 4.0
    """Time constants of the free decay that are waited at least, where an automatic wait ended too early."""

    # checks/dwell.py
    dwell_allowed: float = 0.01
    """Transient in a measurement, relative to the response, above which a dwell is called too short."""

    # checks/internal_resonance.py
    harmonic_share: float = 0.1
    """Of the largest fundamental: docs/joint-law.md has a fifth of it move the fundamental by per cents."""
    harmonic_near: float = 0.1
    """Distance of a mode from a harmonic, over the harmonic: joints soften by as much."""

    # checks/jump.py
    jump_widest: float = 1.5
    """Step across a jump over the resonance's width, above which the grid shows nothing of where and how high it is."""
    jump_narrowest: float = 0.05
    """Stretch between the folds over the resonance's width, below which both ways meet the same steps: nothing to
    gain."""

    # checks/small_signals.py
    most_few: float = 0.2
    """Of the steps near a resonance: so many may lie around an antiresonance."""
    noise_allowed: float = 0.005
    noise_wanted: float = 0.002
    """Standard deviation of a phasor relative to itself: when to warn, and what a longer measurement aims at."""
    noise_longest: float = 16.0
    """How many times longer a measurement is made before more amplitude is the better advice."""
    quantisation_fewest: int = 50
    """Converter steps that the peak value of a sine should have."""

    # checks/too_short.py
    sweep_rate_fastest: float = 216.0 / 60.0
    """Rate over the square of damping ratio times natural frequency up to which a resonance builds up: ISO 7626-2."""
    sweep_rate_wanted: float = 0.5
    """Of the fastest rate, what is advised: at that rate itself the peak still comes out 5 % low."""
    too_short_fewest: float = 3.0
    too_short_wanted: float = 8.0
    """Averages at a resolution of a mode's half-power width: when to warn, and what is advised. n of them give its
    damping ratio within 1 / sqrt(pi n) of itself, a third and a fifth."""
    left_of_a_hit: float = 0.1
    wanted_of_a_hit: float = 0.03
    """Of the lowest mode's decay at the record's end: when to warn, and what is advised."""
    # noise.py
    noise_averages: float = 12.0
    """Stretches that densities and responses are averaged over."""
    most_lines: int = 2000
    """Of a table; more than a picture shows, and twice as many cost a megabyte."""
    # refine.py
    refine_finest: float = 0.4
    refine_reach: float = 4.0
    """Of the resonance's half width: the steps across it, and how far to either side of it they go."""
    refine_widening: float = 0.4
    """Of the distance from there: how wide the steps become farther out, so that a place known badly is not passed
    over."""
    # hammer.py
    between_hits_s: float = 1.0
    """From the end of a hit's record to the next hit."""
    # rehearsal.py
    rehearsal_near: float = 0.02
    """Of a resonance's largest response per force: a step with less of it lies so far off that it tells nothing of
    it."""
    # ring_down.py
    least_above_noise: float = 10.0
    """Amplitude over its own noise, down to which a decay is followed."""
    fewest_windows: int = 4
    """Of a part, so that its slope has a scatter."""
    # turns.py
    turns_allowed_deg: float = 80.0
    """Phase of the response between neighbouring steps. At worst the peak lies half way: cos 40 degrees, a quarter
    low."""
    turns_margin_deg: float = 45.0
    """What a bent resonance turns faster than a linear one before it jumps."""


LIMITS = Limits()
