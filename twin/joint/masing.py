"""Masing's rule: any hysteresis whose branches are its backbone, doubled.

From a reversal at (e_r, f_r) the force goes on as f_r + 2 F((e - e_r)/2), F the odd backbone, and closes earlier loops
where it meets them.  A concave backbone makes a network of sliders that follows the rule on every path: where F's slope
falls by k at x, a spring k slips at the force k x.
"""

import numpy as np

from twin.arrays import Array
from twin.joint.jenkins_element import ParallelJenkins


def masing_of_points(deflection_m: Array, force_N: Array) -> ParallelJenkins:
    """The law whose backbone is straight between points, the first of them (0, 0); beyond, it keeps its last slope.

    Raises
    ------
    ValueError
        If the backbone is not concave, so that no sliders make it.
    """
    x = np.asarray(deflection_m, float)
    slopes = np.diff(force_N) / np.diff(x)
    drops = -np.diff(slopes)
    if slopes[-1] < 0.0 or np.any(drops < -1e-9 * slopes[0]):
        raise ValueError("a backbone that stiffens or falls is no Masing law of friction")
    k = np.append(np.maximum(drops, 0.0), slopes[-1])
    slip_at = np.append(x[1:-1], np.inf)  # the last spring holds
    kept = k > 1e-12 * slopes[0]
    force = np.where(np.isinf(slip_at), 1e6 * k * x[-1], k * slip_at)
    return ParallelJenkins(tuple(map(float, k[kept])), tuple(map(float, force[kept])))
