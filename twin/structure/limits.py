"""Numbers that decide something in `twin/structure`, and where they come from."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """See each."""

    # constraints.py
    constraints_dependent: float = 1e-9
    """Of a constraint's largest entry, what is left of one that the others contain already."""
    # craig_bampton.py
    craig_bampton_off: float = 1e-4
    """Natural frequencies of the whole part may be off by so much; beyond, modes up to twice the frequency are kept."""
    craig_bampton_elastic: float = 1e-3
    """Frequency, over the highest of interest, below which a motion counts as rigid."""
    residual_to: float = 10.0
    """Residual vectors above this multiple of the highest mode kept change nothing below it."""
    modes_limit: int = 600
    """More modes than this are no reduction."""
    dense_order: int = 600
    """Up to here all modes at once cost less than an iteration."""
    craig_bampton_noise: float = 1e-8
    """Of what the modes answer at their limit; a residual that is smaller is rounding."""
    # drawn.py
    drawn_nearest_m: float = 1e-9
    """Points of a layer nearer than that along it are drawn as one."""
    # joint_operators.py
    joint_operators_nothing: float = 1e-12
    """Of the largest row, one that is all zero: a direction in which neither part moves."""
    # law_of_mode.py
    law_of_mode_relaxation: float = 0.6
    """Share of the points' change of motion that a turn takes: the whole swings where a little loss hinders much
    slip."""
    law_of_mode_saturated: float = 0.25
    """Below this damping by more loss modulus, over that in a layer that hardly loses, its share stays what it was."""
    # law_table.py
    law_table_finer: int = 2
    """Elements of the structure over the file's: the law is the joint's and no mesh's."""
    law_table_amplitudes: int = 100
    """At which functions of a sensor's amplitude are translated, beside their own knots."""
    most_knots: int = 200
    """Of a table in a rig file."""
    law_table_below: float = 1e-3
    law_table_beyond: float = 30.0
    law_table_reach_m: tuple[float, float] = (1e-7, 1e-5)
    """Knots of laws by name: from a share of their smallest length to a multiple of the largest; where they have
    none."""
    law_table_forgiven: float = 1e-3
    """Part of a law that a table has no place for and that it may leave out, over the part that it has."""
    law_table_smallest: float = 1e-3
    law_table_nearest: float = 4e-3
    """Of them over the largest; and the least distance between two, over their amplitude."""
    # matrix_coordinates.py
    coordinate_rounding: float = 1e-9
    """Errors of a natural frequency that are told at least: below, the solution of the whole is no better."""
    # mesh.py
    mesh_same: float = 1e-4
    """Of the shortest beam: nodes nearer than this are one.  An element so short is so stiff that rounding in it drowns
    the whole structure's stiffness, and places in a rig file are rounded: the end of an inclined beam, say."""
    same_of_layer: float = 0.25
    """The same of the shortest element of a layer."""
    mesh_beyond_m: float = 1e-6
    """By so much a place may lie beyond an end; it is at the end then."""
    # mode_law.py
    mode_law_independent: float = 1e-6
    """Least part of a static shape that is none of the others'."""
    mode_law_longest: float = 0.7
    """Largest change of a log amplitude in one turn."""
    least_share: float = 1e-3
    """Share of a Newton step that must bring the answer nearer, or there is none."""
    mode_law_difference: float = 1e-5
    """Relative step of amplitude for the slope of a law."""
    # modes.py
    modes_rigid: float = 1e-4
    """Natural frequency of a rigid motion at most, over that of the lowest that must be elastic."""
    # node_field.py
    node_field_thin: float = 0.08
    """Extent over the largest below which a part counts as thin in that direction, and is searched across it no
    more."""
    node_field_apart: float = 1e-6
    """Of the largest extent: nodes nearer than that along the field are one above the other."""
    node_field_across: float = 1e-6
    """What a unit vector may lack of its length in the directions in which nodes move."""
    # own_harmonics.py
    own_harmonics_relaxation: float = 0.6
    """Share of what is missed that a turn corrects: the whole swings where the layer has hardly any stiffness left."""
    # structure.py
    in_a_row: float = 0.999
    """Cosine of the angle to x up to which all beams lie in one row."""
    # sparse.py
    dense_up_to: int = 500
    """Coordinates up to which matrices are dense: below, the lowest modes take LAPACK less time than Lanczos."""
    lanczos_shift_rad2_per_s2: float = 40.0
    """About which the inverse is taken, below zero: a hertz, below any elastic mode, so that rigid motions do no
    harm."""
    # thin_layer.py
    normal_points: int = 4
    shear_points: int = 3
    """Gauss points that integrate the squares of a cubic opening and of a quadratic slip exactly."""


LIMITS = Limits()
