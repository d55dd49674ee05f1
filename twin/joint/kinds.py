"""Numbers by which compiled kernels tell the laws apart, since numba kernels take no functions as arguments.

``FORCE_FACTOR`` is the shaker's, whose force depends on two coordinates: the ordinary laws' kernel has no part in it.
``FUNCTIONS`` is a law given by functions; its parameters begin with their addresses.
"""

(
    LINEAR,
    CUBIC,
    SATURATING,
    SLIDERS,
    HINGES,
    POLYNOMIAL,
    TABLE,
    RUNNING_LOSS,
    QUADRATIC_DRAG,
    FORCE_FACTOR,
    FUNCTIONS,
) = range(11)
