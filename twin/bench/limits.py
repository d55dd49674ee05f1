"""Numbers that decide something in `twin/bench`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # bench.py
    sample_rates_Hz: tuple[float, ...] = (
        512.0, 1024.0, 2048.0, 4096.0, 5120.0, 8192.0, 10240.0, 12800.0, 20480.0, 25600.0, 51200.0, 102400.0, 204800.0,
    )  # fmt: skip
    """Rates the converter has."""
    internal_rate_Hz: float = 11264.0
    """The physics takes at least this many steps a second: enough for all modes that the bench keeps."""
    scattered_modes: int = 20
    """Natural frequencies that differ from one assembly of the rig to the next."""
    bench_assembly: int = 1
    """Of the seed's streams, the one that such differences are drawn from."""
    drift_tolerance: float = 2e-5
    """Relative change of the moduli after which the modes are computed anew."""
    # build.py
    build_resolved: float = 0.4
    """Modes are kept up to this share of the internal rate, since no step resolves faster ones against a joint
    force."""
    build_suspension_Hz: float = 0.05
    suspension_damping: float = 1e-3
    """What hangs free hangs on cords: natural frequency and damping ratio of its rigid motions, so low that from 5 Hz
    on they are those of a body in space to 1e-4."""
    # decimation.py
    half_length: int = 12
    """Output samples on either side of the filter's centre."""
    # generator.py
    rebound_s: float = 0.012
    rebound_share: float = 0.4
    """When and how hard a hammer that is held too long hits again: milliseconds later, weaker; typical."""
    # hits.py
    takes_aim_s: float = 2.0
    """From rest to the first hit at a place: instruments start within it."""
    # layer.py
    reference_opening: float = 1.5e-5
    """End of tabulated laws, m of opening."""
    # many_places.py, marching.py
    many_from: int = 5
    """Local coordinates from which on it is quicker to follow changes than to eliminate."""
    many_changed: float = 1e-3
    """Change of a tangent times flexibility, over the sizes of the coordinates, that is not followed: Newton contracts
    by as much."""
    many_slow: int = 12
    """Newton steps after which rounding is the likely reason that there are so many, and all is made anew."""
    # marching.py
    marching_lanes: int = 16
    """Poles are padded to multiples of this, so that loops over real and imaginary parts fill whole vector
    registers."""
    # reduction.py
    modes_below_Hz: float = 4500.0
    """Modes above are statics only: the converter's band and the joint's harmonics end far below."""
    # shaker.py
    gives_way: float = 100.0
    """Slope of the current's limit over the coil's resistance: the excess is 1 % of what the voltage would drive."""


LIMITS = Limits()
