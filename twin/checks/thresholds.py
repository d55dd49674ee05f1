"""From where on a first look speaks up.

Learnt on clean recordings of the steel rig, the hung lap joint and the hybrid joint from the bench and from another
program, and on recordings with one hidden cause of usual size, all of which must pass: those causes are what a
diagnosis is for.  Checked on other seeds and rigs.
"""

HALF_EMPTY = 0.2
"""Share of a channel's measured samples that are missing, exactly zero or held, from which on it is set aside.  Lost
samples of usual size are 1 %; a step needs three in four of its samples."""
ZEROS_OVER_NEIGHBOURS = 5.0
"""A coarse converter shows zero about as often as the steps next to it; a broken line only zero."""
BEYOND_RANGE = 1.05
"""Over a converter's limit; no sample can be there."""
WILD = 20.0
"""Over the size that one sample in a thousand has: peaks of noise and of slapping joints reach 2."""
FEW = 1e-3
"""Share of samples up to which the wild ones are single ones."""

RATE_ERROR = 5e-3
"""Between a stated rate and the one of the blocks' time stamps; stamps in whole milliseconds of short blocks are off by
4e-3."""
CRYSTAL = 2e-4
"""Between sines and commands; two crystals are apart by 1e-4 at most, and a clock that is a cause by 3e-4 or more."""
CLOCK_ERROR = 3e-3
"""Of sines against the commands, from which on no converter's clock is to blame: they are off by 2e-3 at most."""
ONE_STEP = 0.1
"""Share of the steps' distance within which a sine is one of a step's."""
LEAST_STEPS = 5
"""Of a sweep: level, resonance and loss of a mode, and how each of the latter changes with amplitude, are five."""
TORN = 3e-4
"""Share of a sine's power that a step's four parts have not in common: sound ones have 5e-6, steps without any wait for
settling 2e-5, and those whose log is late by a third of their length 1e-3 to 0.2."""

UNRELATED = 0.3
"""Median coherence beyond chance below which two channels were not recorded together; sound recordings are above
0.9."""
NOT_A_SINE = 0.3
"""Share of a step's power at its frequency and the harmonics below which it shows no response; sound ones have 0.95."""

ALIASED = 0.1
"""Density of the force just below half the sample rate over the band's: behind any filter it is below 0.01."""

GAIN = 1.3
"""A level that is off by no more is the diagnosis' business: gains, masses and moduli of usual size reach 1.2."""
ABSURD = 10.0
"""A level off by more stops, with a name or without, where the shape is the model's: no rig file is that wrong."""
NAMED = 0.07
"""Within so much, in logarithm, a factor has the name of a unit; levels of sound recordings scatter by 0.05."""
ALIKE = 0.08
"""Within so much, in logarithm, channels are off by the same factor."""
SHAPE = 0.5
"""Interquartile range of log response over the model's above which the model is not the recording's; hidden causes
reach 0.4."""
TURNED = 0.25
"""Share of a noise's lines in phase with the model below which a response is turned: sound ones have 0.9, turned ones
0.1."""
CLEARER = 3.0
"""Ratio of misfits from which on another order, or another reason, is the better one."""

PLACE_m = 2e-3
"""Difference of two positions that is more than rounding."""
TARGET = 0.3
"""Logarithm of measured over commanded amplitude from which on a channel was not the one that was held."""

SPECIMEN = 5e-4
"""Relative distance of a sweep's resonance from the other runs' at the same amplitudes: one specimen keeps to 1e-4, two
whose moduli differ by some per cent are 5e-4 to 2e-3 apart."""
SPECIMEN_IN_NOISE = 4e-3
"""The same of noise, beyond what the sweeps' softening leaves open of a small amplitude: 1e-3 with one specimen."""
DRIFTING = 3.0
"""Over what the learnt sweeps differ by among themselves: up to here a drift goes on, and is no other specimen."""

OTHER_PRELOAD = 2.0
"""Median distance of resonances from those of a preload, over what moduli 10 % off make of it, from which on another
one is looked for: specimens whose moduli are up to that far off have 1, with some grams beside that 1.7."""
