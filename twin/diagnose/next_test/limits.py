"""What the proposal of a next test decides by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Figures of the rules in the files that the comments name."""

    # plan.py
    plan_tried: int = 3
    """Proposals that are rehearsed, the best first, until one may be run."""
    plan_far: float = 100.0
    """Separation from which on its size, to first order, says no more."""
    plan_rounds: int = 2
    """Improvements of a proposal that a rehearsal warns of."""
    # predicted_data.py
    law_points: int = 64
    """Amplitudes at which the response to a frequency is computed, to find the one that a force makes."""
    amplitude_range: tuple[float, float] = (2e-3, 1.6)
    """Range of these, over the recordings' smallest and largest amplitude: about a higher mode a displacement is
    small."""
    # proposal.py
    noise_longer: tuple[float, float, float, float, float] = (1.0, 2.0, 4.0, 8.0, 16.0)
    """Lengths of noise, and of a measured step, over those of the recordings."""
    most_rms: float = 4.0
    """Largest rms force of a band of noise over that of the recordings."""
    noise_lowest_Hz: float = 5.0
    above_last: float = 1.2
    noise_oversampled: float = 4.0
    """Of a first noise: its band's lower edge, the upper one over the last damped mode, samples a period of it."""
    noise_quiet: float = 1 / 3
    """Its rms force over the smallest sine's amplitude: the joint is to act as in the smallest sweep or less."""
    noise_crest: float = 5.0
    """Peaks of noise over its rms."""
    noise_tolerance: float = 2e-4
    """What may be left of a transient; near a sharp resonance a model is held against a step as exactly as this."""
    # sensor_place.py
    on_beams: int = 12
    """Places along all beams together."""
    on_part: int = 16
    """Nodes of a part given by matrices, the most evenly spread."""
    # separation.py
    separation_sure: float = 1.28
    """Standard deviations that a test must have in hand, for nine in ten to part the models."""
    # sweeps.py
    sweeps_headroom: float = 0.8
    """Share of a converter's range that may be used."""
    sweeps_steps: int = 35
    """Of a proposed sweep."""
    sweeps_harder: tuple[float, float, float] = (0.5, 1.0, 1.3)
    """Largest forces of a sweep over the largest of the recordings; beyond these the joint's law is not known."""
    sweeps_opened: tuple[float, float] = (0.3, 0.9)
    """Largest opening or slip of a layer point at another mode's resonance, over the largest that was measured: the
    law is known up to there."""
    sweeps_linear: float = 1e-3
    """The same of a joint that acts as a linear one."""
    sweeps_searched: float = 0.1
    sweeps_fine: int = 400
    """Relative range below and above a natural frequency in which its resonance is sought, and the frequencies
    there."""
    sweeps_turns: int = 8
    """Of the motion of the layer's points and the stiffness that it leaves; each halves what is left to change."""
    sweeps_widths: float = 4.0
    """Half-power widths to each side of the resonances, with the joint linear and as soft as was measured."""
    sweeps_loudest: float = 2.0
    """Force over the largest that was used up to which the shaker is trusted."""
    # plan.py
    needed_log_evidence: float = 5.0
    """Gain of log evidence by which a rival is told from the best."""


LIMITS = Limits()
