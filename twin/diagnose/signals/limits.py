"""What tells a fault of the samples from what sound samples show."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Figures of the rules in the files that the comments name."""

    # causes/clipping/finding.py
    clipping_least_count: int = 12
    """Samples on exactly one largest value, a third of them in a row, that are no chance."""
    clipping_most_over_limit: float = 1.05
    """A run that exceeds a limit by more was not limited: it may be of another day."""
    clipping_equal: float = 1e-7
    """Relative difference of samples on one limit."""
    clipping_high: float = 0.98
    clipping_top: float = 2e-3
    clipping_shoulder: float = 0.9
    """Share of the largest value that peaks must reach; depth of a top below its usual level; where its shoulders
    begin."""
    clipping_least_width: int = 8
    clipping_least_tops: int = 3
    """Samples between a peak's shoulders, and flat peaks, that are enough to judge by."""
    clipping_flat: float = 0.5
    """Width of a top over that between the shoulders: a whole sine has a quarter, one cut by a tenth three quarters."""
    clipping_far: float = 0.01
    """Share of a limit by which noise hardly ever exceeds it: a sample farther out is not on it."""
    clipping_least_count_deviations: float = 2.5
    """Standard deviations of a count by which more samples lie above a level than below it."""
    clipping_level: float = 5e-4
    """Tops on one limit are level within this share of it, or within what their noise leaves of their means."""
    clipping_shaped: float = 5.0
    """Deviation of the samples within a top over that which the tops' means tell of their noise: from here on the
    tops have a shape of their own, as harmonics give them where a sweep rests on a step, and nothing cut them. It
    is one where there is noise alone."""
    clipping_several: int = 3
    """Drives of a run from which on a limit would show at more than one of them."""
    clipping_ringing: int = 2
    """Samples on either side of a cut that a converter's filter still mixes with it."""

    # causes/lost_samples/finding.py
    lost_samples_least_length: int = 6
    lost_samples_least_steps: float = 60.0
    """A hold is that many equal samples, of a channel whose rms is that many of its smallest steps."""
    lost_samples_fewest: int = 3
    lost_samples_certain: int = 12
    """Holds that are no chance, or samples of a single one."""
    lost_samples_least_jump: float = 5.0
    """Smallest steps by which a channel that stood still is off when it goes on; a slow one goes on by one or two."""
    lost_samples_limit: float = 0.99
    """Share of the largest value from which standing still is a matter of clipping."""

    # causes/mains_hum/finding.py
    mains_hum_least_power: float = 12.0
    """Mean power of the line over the steps, in units of the noise beside it."""
    mains_hum_least_power_in_noise: float = 36.0
    """The same of a line in one broadband run, whose noise is that of a few lines beside it."""

    # causes/quantisation/finding.py
    quantisation_coarsest: float = 3.0 / 2**15
    """Share of the range that a step may have: somewhat more than a 16-bit converter's."""

    # causes/sample_clock/finding.py
    sample_clock_least_ppm: float = 50.0
    sample_clock_least_sigma: float = 6.0
    """An error below this is what two good clocks differ by, and harms nothing."""
    sample_clock_own_error_ppm: float = 0.5
    """Of the estimate beside its scatter: what is left of transients turns the phase too."""

    # diagnose/signals/hum_in_noise.py
    hum_lobe: int = 2
    hum_around: int = 14
    """Spectral lines on either side that a windowed steady line fills, and that tell what the force makes there."""

    # diagnose/signals/remainder.py
    remainder_rows: int = 8192
    """Samples whose columns are in memory at a time; a usual step is one such part, and has them made once."""
    remainder_alike: float = 1e-12
    """Share of the largest below which an eigenvalue of the columns' products is that of two alike."""

    # diagnose/signals/sidebands.py
    sidebands_samples: int = 1 << 18
    """Of a step, from its beginning, that are looked at: ten seconds at 25.6 kHz tell a tenth of a hertz."""
    sidebands_nearest: float = 2.0
    """Distance over the resolution of a step from which on a line is apart from the drive's, with what drifts there."""
    sidebands_farthest_Hz: float = 12.0
    sidebands_apart_Hz: float = 0.1
    """Of the distances that are looked at, and between them."""
    sidebands_fractions: tuple[float, float] = (1 / 2, 1 / 3)
    """Of the drive's frequency, where a structure may answer as well."""
    least_log_bayes: float = 10.0
    """From which on they are told; 43 recordings without any, of the bench and two other programs, show 5.7 at the
    most."""

    # diagnose/signals/unsettled.py
    unsettled_least_steps: int = 8
    least_share: float = 0.25
    """Steps of a sweep that tell anything, and the share of them that must change: a jump alone leaves only a few."""


LIMITS = Limits()
