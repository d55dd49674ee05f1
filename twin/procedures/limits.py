"""Numbers that decide something in `twin/procedures`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # brake.py
    widest_turn: float = 0.6
    """Largest turn of the force's phase, rad: the plan is linear in the structure."""
    least_beat: float = 1.0
    """Beats slower than this many radians a time constant are left alone: next to a resonance a detour passes over
    it."""
    # broadband.py
    trial_s: float = 2.0
    """Over which a level, or the fall of a transient, is seen well enough; of a multisine whole periods."""
    still_falling: float = 0.9
    """What has not fallen to this part of itself within `trial_s` does not fall: time constants up to 19 s do."""
    # impact.py
    looked_for_s: float = 0.1
    """A hit is looked for in pieces of this length: several blocks of an instrument, and no wait that is felt."""
    # session.py
    fitted_harmonics: int = 20
    """While waiting too: one that is left out looks like noise, which excuses an amplitude that is not held and a
    transient.  The ninth of a hung lap joint had 0.3 of the fundamental, and ended waits at 1 % of the transient."""
    # settling.py
    usual_damping_ratio: float = 0.0023
    """Of a bolted steel structure: what is assumed before the data tell."""
    settling_full: int = 8
    settling_fewest: int = 4
    """Windows looked at; and how many are enough where the decay is known and shows within them."""
    well_known: float = 2.5
    """Most that noise and model errors of one window may grow by when the transient is told from the rest."""
    # sine_fit.py
    whole_fit: int = 1 << 14
    """Samples up to which a fit's matrices are made whole and kept for the next channel, 12 MB for 20 harmonics; a
    longer window, as of 1 s at 25.6 kHz, is fitted in parts of this length.  With whole ones the windows of a wait
    take 3 ms a channel there, with parts 15."""
    # stream.py
    silent_device_s: float = 5.0
    """A device this far behind the others has fallen silent."""
    # stretch.py
    piece_s: float = 10.0
    """Of a long stretch, what is in memory at a time: 4 MB of four channels at 25.6 kHz."""


LIMITS = Limits()
