"""Numbers that decide something in `twin/diagnose`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # cause.py
    cause_ratio: float = 1.4
    """Between neighbouring thresholds to begin from: a fit finds its way from a sixth beside the true one."""
    # comparison.py
    second_harmonic_deviations: float = 10.0
    """Standard deviations a second harmonic must have to be held against a model."""
    # diagnose.py
    diagnose_threshold: float = 2.0
    """Chi2 per degree of freedom, with the errors of sound rigs, that a sound rig seldom exceeds."""
    diagnose_beyond: float = 1.05
    """Amplitude over the largest one learnt from up to which a law is taken to hold."""
    # exclusion.py
    exclusion_limit_95: float = 1.645
    """Standard deviations below which 95 % of a normal distribution lie."""
    # gaussian_process.py
    gaussian_process_felt: float = 0.01
    """Least variance of a column, summed over its points: a tenth of the process's deviation at one of them."""
    # model_evidence.py
    model_evidence_any: tuple[float, float] = (-15.0, 15.0)
    """Logarithm of an error over a sound rig's in which the likeliest is looked for: from less than any noise to more
    than the response itself, so that a long step of the search meets no error of zero."""
    model_evidence_roughness: tuple[float, float] = (-14.0, 4.5)
    """Logarithm of the roughness over a sound rig's in which the likeliest is looked for: a loss may be nearly none."""
    model_evidence_size: tuple[float, float] = (-3.5, 5.0)
    """The same of the error of the shares in odd harmonics."""
    model_evidence_shifts: tuple[float, float] = (-3.5, 3.0)
    """And of the shifts: rooms change by ten kelvin at most, twenty times half a kelvin."""
    model_evidence_close: float = 1e-7
    """Relative change of the log evidence that ends the search for errors: a thousandth of a nat."""
    model_evidence_refitted: int = 6
    """Most fits, each with the errors that the last one inferred."""
    # parallel_map.py
    parallel_map_most: int = 4
    """Each process takes some 300 MB, and there are seldom more fits than would keep these busy."""
    parallel_map_remembered: int = 4
    """Most sets of common arguments that a process keeps."""
    # places.py
    places_region: float = 0.95
    """Probability of the region of nodes that is reported with a place."""
    # posterior.py
    posterior_temperature: float = 3.0
    """Factor by which differences of log evidence overstate what they say, since models are approximate."""
    # law_tolerances.py
    law_tolerances_slip: float = 1.0
    """Stiffness in slip that a joint may give or take, over what it loses there: a Jenkins element takes 1.6 times as
    much where it loses most, and less where it begins to slip."""
    # profile.py
    profile_hopeless: float = 1.2
    """Cost over the least so far beyond which a fit leads nowhere: barriers between maxima are some per cent high."""
    # racing.py
    racing_close: float = 0.1
    """Standard deviations within which two fits have come to the same; fits that are not yet exact leave up to one."""
    # score_test.py, law_tolerances.py
    score_test_felt: float = 0.3
    """Least size of a direction of the tolerances, in standard deviations of the data."""
    score_test_towards_middle: float = 0.5
    """Standard deviation of where an element's opening counts, from its mean (0) to its middle (1)."""
    # search.py
    search_follows: float = 3e-4
    """Error of stiffness up to which a model follows the data: beyond, a resonance is a good part of its width away."""
    held_levels: int = 3
    """Model errors through which a cause that the law can imitate keeps its size: with larger ones the data tell the
    law, but no threshold, which would drift to where it is never met."""
    # set_aside.py
    set_aside_enough: int = 16
    """Steps of which a quarter can be spared."""
    # shortfall.py
    several_times: float = 3.0
    """Rms error on what was held out, in what a right model leaves of each, beyond which something is unexplained."""
    least_growth: float = 0.1
    """Of the same: by how much an error must rise to have grown.  The rms over fifty steps is known no better."""
    # slider_in_noise.py
    slider_in_noise_least: float = -15.0
    slider_in_noise_most: float = 15.0
    """Logarithms of the odds of slipping between which it is sought."""
    # marginal_posterior.py
    negligible_nats: float = 7.0
    """Below the largest part of a posterior, what adds a thousandth."""
    beside_iterations: int = 6
    """Of a fit at the next place, half of one start's distance away, which begins where the last one's valley leads."""
    # verdict.py
    worth_a_line: float = 0.01
    """Least probability of a rival that is told."""
    # missing/force.py
    usual_n: float = 2.0
    """Force of a term at the largest measured motion of the tip, one standard deviation of its prior."""
    # missing/picture.py
    picture_follows: float = 4.0
    """Chi2 per degree of freedom, with a sound rig's errors, up to which a model follows the data."""
    least_fundamental: float = 0.01
    """Of the largest force within a period, below which its phase says nothing."""
    most_left: float = 0.05
    """Of a large chi2 per degree of freedom, for a force to be a picture of what is missing."""
    picture_places: int = 14
    """At which it is tried along the structure."""


LIMITS = Limits()
