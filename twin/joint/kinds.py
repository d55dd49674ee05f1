"""Numbers by which compiled kernels tell the laws apart, since numba kernels take no functions as arguments."""

LINEAR = 0
CUBIC = 1
SATURATING = 2
SLIDERS = 3
HINGES = 4
POLYNOMIAL = 5
TABLE = 6
RUNNING_LOSS = 7
QUADRATIC_DRAG = 8
FORCE_FACTOR = 9
"""Of the shaker: its force depends on two coordinates, which the ordinary laws' kernel has no part in."""
FUNCTIONS = 10
"""A law given by functions; its parameters begin with their addresses."""
