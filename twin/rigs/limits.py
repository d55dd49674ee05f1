"""Numbers that decide something in `twin/rigs`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # beam_part.py
    beam_part_along: float = 0.999
    """Cosine of the angle from which a beam's thickness counts as measured along its axis."""
    beam_part_upright: float = 1e-6
    """Share of an axis in x and y below which a beam in space stands along z."""

    # layout.py
    layout_across: float = 0.1
    """Cosine of the angle between two directions below which they say nothing about each other's sense."""
    layout_rounded_m: float = 1e-9
    """By so much a place may lie beyond an end."""

    # matrix_files.py
    matrix_files_negative: float = 1e-12
    """By so much of the largest entry rounding may take a diagonal entry below zero."""
    matrix_files_slowest_rad_per_s: float = 1.0
    """Of a row's own stiffness on its own mass; an element of any part on a bench is thousands of times as fast."""

    # preloads.py
    preloads_near: float = 0.05
    """Departure of a recorded preload from the rig's that needs no mention."""

    # structure_rig.py
    bench_finer: float = 1.5
    """Elements of beams on the bench, over the file's; layers have twice as many."""
    structure_rig_parallel: float = 1e-6
    """Sine of the angle up to which two beams may be joined by a layer."""
    structure_rig_aside: float = 0.01
    """Of the narrower of two beams, by which their axes may lie beside each other under a layer."""
    structure_rig_facing: float = 0.999
    """Cosine of the angle between a strain gauge's direction and the normal of its beam, at least."""
    structure_rig_beyond_m: float = 1e-6
    """By so much a place or a layer may lie beyond a beam's end."""

    # tables.py
    more_than_all: float = 1.0 + 1e-6
    """Of a modulus that a law may take off it, lest rounding forbid all of it."""
    hardest_stop_Hz: float = 3000.0
    """Of the armature's mass on its end stop; the marching of a spring is stable to a third of its rate."""


LIMITS = Limits()
