"""Numbers that decide something in `twin/identify`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # backbone.py
    frequency_scale: float = 1e-4
    """Scatter expected of a sweep's frequency, relative: what reassembly-free repetition on a bolted beam reaches."""
    phase_offset: float = 1.0
    """A weak prior on the phase offset (rad), which alone decides it where no phase was kept."""
    backbone_shifted: float = 4.0
    """A sweep further from the others' curve than this many robust standard deviations is called shifted."""
    # base_fit.py
    largest_loss: float = 10.0
    """Loss modulus that is looked for, over E'."""
    read_off: float = 1e-3
    """Relative error of a response within which a step's softening and loss count as found."""
    base_fit_smoothness: float = 0.04
    """Weight of a law's curvature over the logarithm of amplitude beside the steps' own when it is first read off
    them."""
    softening_of_a_step: tuple[float, float] = (-0.5, 0.98)
    """Least and largest that is looked for, over E'."""
    base_fit_reweighted: int = 4
    """Most fits with one model error, each with the weights at the last one's end, until they gain nothing."""
    base_fit_tolerance: float = 0.3
    """Gain of a fit with new weights, in units of the cost per degree of freedom, at which they are left as they
    are."""
    base_fit_followed: float = 100.0
    """Chi2 per degree of freedom, residuals of ten times their errors, beyond which errors get no smaller.  Learnt on
    the second bench's seeds 508 and 701 and the catalogue's 2611: with it fits end at better maxima in three."""
    coarse_tolerance: float = 2.0
    """The same while the model errors are not yet the last ones."""
    # broadband.py
    bin_share: float = 0.12
    """A bin's width beside its distance to the nearest resonance."""
    half_width_Hz: float = 0.02
    """Least distance to a resonance that is told apart."""
    broadband_kinked: float = 2.0
    broadband_around: int = 10
    broadband_coarse_Hz: float = 0.5
    """A bin wider than the last whose lines scatter by this factor more than the bins around it hides a resonance."""
    broadband_noisiest: float = 0.2
    """Relative standard deviation up to which a bin is kept."""
    # error_model.py
    error_model_any: float = 1e4
    """Largest stiffness error of a model that lacks something, over a sound rig's: a resonance is then a per cent
    off."""
    # frequency_model.py
    shifted_by: float = 0.01
    """Of the lowest measured frequency: so far the modes are shifted where a rigid motion would make K singular."""
    frequency_model_followed: int = 3
    as_probable: float = 2.5
    """Places of the grid from which fits begin; standard deviations beforehand within which they are looked for."""
    # frequency_moduli.py
    unknown_std: float = 10.0
    """Standard deviation of the moduli's logarithms beforehand: the frequencies alone decide, and none runs off."""
    frequency_moduli_fine: float = 1e-3
    """Tolerance of the fit: few frequencies leave narrow valleys, along which it creeps."""
    # gaps.py
    gaps_order: int = 96
    """Of the prediction: two for each mode in band, and as many again for sensors, shaker and filter."""
    gaps_most: int = 2048
    """Missing samples of one gap, or of several that the prediction couples; across more of them lines are drawn."""
    gaps_straight: float = 1e-6
    """Deviation from a straight line, over the largest sample, of a signal that is one."""
    self_noise: float = 1e-10
    """Relative to the power: what keeps the prediction of a signal without noise finite."""
    # gauss_newton.py
    gauss_newton_probed: float = 0.1
    gauss_newton_sharpest: float = 0.75
    """Part of a step at which the residual's curvature is looked at, and twice the largest turn it may make of a
    step."""
    gauss_newton_trials: int = 10
    """Dampings tried in one iteration, each eight times the last."""
    gauss_newton_active_sets: int = 30
    """Most sets of limits tried for one step; nearly all end within five."""
    gauss_newton_left: float = 0.1
    """Of the tolerance, what an undamped step may still promise where no further one is tried."""
    gauss_newton_halved: int = 6
    """Most parts of a round that are tried, each half of the last."""
    # harmonics.py
    signature_error: float = 0.04
    """Relative error of the joint's signature."""
    share_error: tuple[float, float, float] = (0.12, 0.34, 0.57)
    """Of a point's share in each of the odd harmonics, which the law's time form foretells: the higher, the finer the
    part of the law that it hangs on.  Middles over three programs that share no code, whose own lie within a factor of
    three but for one: the bench (steel rig, seeds 101 and 102: rms 0.041, 0.056, 0.27), `foreign/clean` with one mode
    and with two (0.08, 0.13, 0.35), the second bench (seeds 501 and 502, whose joint loses otherwise: 0.5, 4, 2)."""
    even_error: float = 0.12
    """Relative error of any model of the even harmonics: lost contact on the bench, with its true size, errs by 0.09
    and 0.11, a stop of another program's by 0.03."""
    resonance_error: float = 0.002
    """Relative error of the higher natural frequencies at large amplitudes: it matters to harmonics that fall near
    them."""
    linear_error: float = 0.1
    """Relative error of the response to the force's own harmonics, some of which fall near other resonances."""
    # held_response.py
    held_response_stride: float = 0.25
    """Of the logarithm of the amplitudes at which the motion is found one from the other, the same for every
    question."""
    held_response_difference: float = 1e-4
    """Relative step of a damping ratio for a derivative."""
    held_response_felt: float = 1e-3
    """Softening over E' below which an opening has no harmonics to speak of."""
    # identified.py
    poor_fit: float = 1.5
    """Chi2 per degree of freedom above which the model misses something."""
    # joint_law.py
    joint_law_smallest: float = 0.01
    """First knot over the largest amplitude: below it a law is all but linear."""
    last_knot: float = 1.15
    """Last knot over the largest amplitude, for a fit may open the layer a little farther than its start did."""
    run_out: float = 1.0
    """Logarithm of amplitude over which a law levels off beyond its last knot.  A corner there would be a trap: where
    the layer opens farther yet, a fit ended as soon as the largest motion came to it."""
    never: float = 1e3
    """Logarithm of amplitude over the last knot that no amplitude comes to."""
    no_data_m: float = 1e-6
    """Last knot where no sweep tells how far the layer moves."""
    joint_law_knots: int = 40
    """Fine enough for two modes at once: a force that was left out is then foretold to 0.9e-3, by 24 knots to
    2.0e-3."""
    loss_scale: float = 2.4
    """Of a joint's loss, over G': the shipped steel joint's damps mode 1 as a tenth of E' would."""
    joint_law_largest: float = 5.0
    """Prior size of a curve over its scale, for every unit of log amplitude: little more than that it is finite."""
    # joint_motion.py
    unknown_m: float = 1e-8
    """Where nothing was measured that could tell."""
    # l_curve.py
    l_curve_smallest: float = 1e-8
    """Weakest regularisation tried, as a share of the largest singular value: below it the sums are round-off."""
    # linear_fit.py
    frequency_std: float = 1e-4
    """Prior of what the finite elements and rounded dimensions leave wrong in a natural frequency."""
    damping_std: float = 0.5
    each_damping_std: float = 0.15
    """Prior of the logarithm of all damping ratios at once, and of each beside the others: what a structure's damping
    is like is known roughly, and one mode far out of line has a cause."""
    wide_frequency: float = 0.03
    """Prior of a frequency discrepancy while a fit finds its way."""
    largest_alignment: float = 0.2
    """A resonance farther off than this, as a logarithm, is not taken for the model's."""
    reduced_order: int = 30
    """Of the rational functions that a broadband run's bins are about: two for each of the modes whose damping is
    identified, and twice as many again for what the model does not have, and for noise."""
    linear_fit_astray: float = 4.0
    linear_fit_found: float = 2.0
    """Chi2 per degree of freedom from which on other moduli are tried to begin with, and up to which they are
    assumed."""
    # linear_forward_model.py
    least_left: float = 0.01
    """Share of E' that a drift leaves at the least, however long it goes on: a bolt never pushes."""
    # linear_model.py
    damped_modes: int = 5
    """Modes whose damping ratios are identified; those above keep what is assumed."""
    # local_forces.py
    local_longest: float = 2.0
    """Largest change of an amplitude in one turn, over its size."""
    local_settled: float = 1e-11
    """Norm of the disagreement of amplitudes, over the largest, that ends the search for a balance."""
    local_difference: float = 1e-5
    """Relative step of amplitude or stiffness for a derivative."""
    harmonics_step: float = 1e-3
    """The same of a cause's parameter for what harmonics add, which is smooth in it and found to 1e-6 only."""
    # loop_files.py
    loop_files_uneven: float = 0.01
    """Largest deviation of a time step from the mean one, as a share of it."""
    # modal_prediction.py
    farthest_amplitude: float = 1.6
    """How far beyond the identified amplitudes solutions are looked for, as a factor."""
    # model_modification.py
    unchanged_moduli: tuple[float, float] = (1.0, 1.0)
    """Factors on E' and G' of a joint that nothing is wrong with."""
    # natural_frequencies.py
    assumed_std: float = 1e-3
    """Relative standard deviation of a frequency whose table gives none: bolted structures repeat to about 0.1 %."""
    model_std: float = 1e-4
    """What a mesh and rounded lengths do to any frequency, relative, beside what a table states."""
    joint_std: float = 0.3
    """Of the logarithms of E' and G' beforehand: a layer's moduli are known from its frequencies, and hardly before."""
    beam_std: float = 0.5
    """Of a Young's modulus' logarithm beforehand: laminates differ from their data sheets by such factors."""
    # opening_harmonics.py
    odd_harmonics: tuple[int, int, int] = (3, 5, 7)
    """Harmonics that are balanced where the force is odd."""
    even_too: tuple[int, int, int, int, int, int, int] = (0, 2, 3, 4, 5, 6, 7)
    """Where it is not."""
    opening_balanced: float = 1e-7
    """Newton step over the fundamental at which the harmonics are in balance."""
    opening_stuck: float = 1e-4
    little_by_little: tuple[float, float, float, float] = (0.25, 0.5, 0.75, 1.0)
    """Where Newton's method leaves more, the contact that a slap loses is lost by these shares, one from the other."""
    least_tangent: float = 0.02
    """Of the linear modulus: a passive layer never has a negative tangent, whatever a spline does between its data."""
    # polynomials.py
    poor_polynomial_percent: float = 0.5
    """What a law may leave of the response and still be called right."""
    # predict.py
    law_knots: int = 80
    """Of the splines that stand for a rig file's piecewise cubic functions."""
    corner: float = 1e-9
    """Logarithm of amplitude over which they level off: beyond its last knot a file's law is constant."""
    least_knot: float = 1e-3
    """First of them over the last, where the file begins with zero."""
    predict_smallest: float = 1e-4
    predict_least: float = 1e-8
    """Least amplitude of the search beside the largest, where the rig is linear; and where the force is very small."""
    past_law: float = 2.0
    """Largest amplitude of the search over that at which the joint's law has its last values."""
    predict_near: float = 0.1
    """How near to its target, as a logarithm, a curve that turns is looked at more closely."""
    predict_root: float = 1e-10
    """Of the logarithm of force over target."""
    predict_seen: float = 1.02
    """Amplitude of a point over the law's last knot up to which the law counts as seen."""
    law_error: float = 4e-4
    response_error: float = 4e-4
    """Relative standard deviation of a law's value, and of a response, beside what is known of the parameters: of three
    rigs with a law learnt in mode 1 (seeds 3101 to 3103) mode 2 missed by that."""
    # rebinning.py
    lines_at_once: int = 4096
    """Spectral lines whose receptances are held in memory together."""
    # resonances.py
    resonances_apart: float = 1.5
    """Ratio of neighbouring frequencies beyond which they belong to different resonances."""
    # robust_curve.py
    robust_curve_freedom: float = 2.0
    """Degrees of freedom of Student's distribution: few, so that one strange value cannot bend the curve."""
    robust_curve_parsimony: float = 1.5
    """A lower order is kept unless a higher one predicts better by more than this in log-probability."""
    # settled.py
    least_change: float = 2e-3
    """Relative change of a fundamental within its measurement below which a step is a steady state whatever its
    noise."""
    false_alarms: float = 0.01
    """Chance that among all steps of sound recordings one is taken for unsettled by its noise."""
    noise_lines: int = 10
    """Spectral lines behind each estimate of the noise, at the fewest: a window of five periods leaves so many."""
    # sine_fit.py
    sine_fit_neighbours: int = 12
    """Spectral lines on each side of a harmonic from which its noise is estimated."""
    sine_fit_rows: int = 8192
    """Samples whose columns are in memory at a time, 6 MB for 40 harmonics: a usual step of 2 s at 2 to 4 kHz is one
    such part, and is fitted without making them twice."""
    least_sound: float = 0.75
    """Share of a step's samples that must be there in every channel."""
    sine_fit_samples: int = 1 << 18
    """Samples of which one spectrum tells the noise, ten seconds at 25.6 kHz: that of a longer step is a mean."""
    sine_fit_passed: float = 0.4
    """Of the sample rate: above lies the transition of usual anti-aliasing filters, where sizes mean nothing."""
    sine_fit_apart: float = 1.5
    """Distance of a line from a harmonic, over 1 / duration, from which on the two are told apart."""
    # spectrum.py
    spectrum_samples: int = 1_600_000
    """Of a record that is transformed in one piece, a minute at 25.6 kHz: a longer one is reduced part by part."""
    spectrum_overlapping: float = 1 / 6
    """Correlation of Hann-windowed segments that overlap by half (Welch 1967)."""
    # updated_rig.py
    law_points: int = 48
    """Knots of the law in a file, enough that its piecewise cubic functions are the splines that were fitted."""
    updated_rig_below: float = 3.0
    """First knot of the fitted law over the file's first one above zero."""
    # impacts/hits.py
    full_scale: float = 0.9999
    """Share of a converter's range from which on a sample is on its limit: a bit short of it, of any converter."""
    pulse_foot: float = 0.1
    """Of a pulse's peak: where it is told to begin and end."""
    pulse_ringing: int = 16
    """Samples beside it in which an anti-aliasing filter rings."""
    second_hit: float = 0.05
    second_over_noise: float = 10.0
    """Of the peak: a second pulse of this size makes 5 % ripples on the force's spectrum; and over the median of the
    rest, which normal noise does not reach in a million samples."""
    # impacts/reduction.py
    window_wanted: float = 0.003
    """Of the response at the record's end, that an exponential window is to leave: below what a lab reproduces."""
    window_leaks: float = 0.02
    """Left at the end, from which on leakage moves dampings by per cents."""
    moving_before: float = 0.02
    """Of the response, before the hit: two per cent of another hit's motion."""
    excited: float = 0.01
    """Power of the force over its largest, 20 dB down: up to there a hammer is said to excite."""
    lowest_line: float = 10.0
    """Over the record's length: below, drift and what holds a hung structure."""
    force_taper: float = 0.5
    """Share of the force window that its two ends take."""
    coherent_lines: int = 9
    """Over which the variance that coherence tells is averaged."""
    # impacts/modes.py
    loaded: float = 1e-3
    """Relative change of a frequency by a mass that roves, from which on it is told: what a lab wants of one."""
    window_drowns: float = 3.0
    """Damping that a window adds, over a mode's own, from which on little is told of the mode's."""
    satellite: float = 0.02
    satellite_alike: float = 0.8
    satellite_scatter_deg: float = 10.0
    """Relative distance and MAC of a pole from a sharper one, whose decay it makes up for where frequency and damping
    follow the amplitude; phase scatter from which on a shape is no lightly damped mode's."""
    # modes/beside_model.py
    at_a_node: float = 0.03
    """Motion of a place in a mode, over the structure's largest, below which it hardly shows the mode."""
    hardly_told_apart: float = 0.9
    """MAC of two of a model's own modes, from which on a measured shape may be either's."""
    # modes/fit.py
    fit_window: float = 4.0
    """Ratio of the ends of the narrower bands."""
    fit_rounds: int = 2
    """Of looking for modes in what is left, with a better estimate of the noise each time."""
    fit_same: float = 0.5
    """Two poles this share of a damping ratio apart, relative to their frequency, are one mode."""
    fit_narrowest: float = 0.1
    """Least half-width of a mode, in line spacings."""
    fit_vague: float = 0.5
    """Relative standard deviation of a damping from which on a pole is no mode."""
    fit_needed: float = 3.0
    """A mode stays if it lowers chi-square by this many times what Schwarz's criterion asks for its parameters."""
    # modes/from_record.py
    from_record_averages: float = 12.0
    """Stretches of the first estimate."""
    from_record_rounds: int = 8
    from_record_moved: float = 0.05
    """Most rounds of fitting poles and taking their decays off, and the move of any pole, over its half width, that
    needs no further one: four rounds are usual."""
    # modes/noise.py
    noise_surroundings: int = 201
    noise_spacing: int = 10
    """Lines over which noise is taken to be alike, and at every how many of them it is looked at."""
    # modes/pairing.py
    pairing_farthest: float = 0.3
    pairing_least_mac: float = 0.5
    """Logarithm of frequencies, and modal assurance criterion, from which on two modes are no pair."""
    # modes/rational.py
    rational_chunk: int = 4096
    """Lines that are summed at once."""
    rational_edge: float = 0.98
    """Share of the unit half circle that the band takes: a pole at its very end would be real."""
    # modes/refinement.py
    refinement_damping: tuple[float, float] = (1e-5, 0.99)
    """Least and largest damping ratio of a pole: a hundredth of what bolted steel has, and one that still swings."""
    refinement_far: float = 100.0
    """Factor below the first line and beyond the last at which a pole is nothing but a remainder."""
    refinement_dependent: float = 1e-13
    """Singular value over the largest below which residues count as dependent."""
    largest_step: float = 0.5
    """Of a step of log damping; of log frequency in half-widths."""
    # modes/stabilisation.py
    frequency_tolerance: float = 0.003
    damping_tolerance: float = 0.15
    """Relative changes from one order to the next that a stable pole may have."""
    widest_half_widths: float = 2.0
    """Poles of different orders belong together if they are this many damping ratios apart, or the tolerance."""
    largest_damping: float = 0.2
    """A pole damped more than this makes up for what lies outside the band, and is no mode."""
    stabilisation_share: float = 0.4
    """Least share of the orders, from its first on, in which a mode must be stable."""


LIMITS = Limits()
