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
    # lap_joint.py, structure_rig.py
    most_sensors: int = 128
    """Of a rig: as many as a large front end has inputs."""
    most_elements: int = 1000
    """Of a beam: on the bench's finer mesh of them rounding in the stiffness moves the steel rig's first natural
    frequency by 3e-4 already, and by sixteen times as much with every halving."""
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
    # imported/facing.py
    facing_gap: float = 0.5
    """Of the distance between a part's own neighbours: nodes farther apart do not face each other."""
    facing_edge: float = 3.0
    """Times the usual edge of a patch's triangles: longer ones bridge from one patch to the next and carry nothing."""
    # imported/places.py
    places_far: float = 0.05
    """Of the structure's size: a nearest node farther off is told."""
    # imported/text.py
    coincident_height_m: float = 0.001
    """Of a layer between nodes that coincide: its moduli are per this height, and nothing else depends on it."""
    # imported/units.py
    units_sound_m_per_s: float = 5000.0
    """Bar waves in steel, aluminium and glass; 3400 in brass, 1700 in a polymer, 9000 in carbon fibre."""
    units_size_m: float = 0.4
    """Of a part on a bench; a factor of 10 more or less is common."""
    units_unlikely: float = 0.5
    """Weight of a decade of size beside a decade of the speed of sound, which differs less from part to part."""
    least_decades: float = 0.7
    """Decades by which the best of the units must be better than the next."""
    units_strange: float = 1.5
    units_impossible: float = 4.0
    """Decades off the usual speed of sound from which the units are doubted, and from which these are no such
    matrices."""
    # matrices/abaqus.py
    abaqus_held: float = 1e35
    """Abaqus writes 1e36 on the diagonal of a degree of freedom that a boundary condition holds."""
    # matrices/dmig.py
    dmig_symmetric: int = 6
    dmig_square: int = 1
    """Forms of a matrix (field IFO): of the first only one triangle stands in the file."""
    dmig_real: tuple[int, int] = (1, 2)
    """Types (field TIN): single and double precision; 3 and 4 are complex."""
    # matrices/found.py
    found_components: int = 128
    """More than any program has degrees of freedom at a node."""
    # matrices/read.py
    read_asymmetry: float = 1e-6
    """Largest difference across the diagonal, over the largest entry, that is taken for rounding."""


LIMITS = Limits()
