"""Masing's rule: any hysteresis whose branches are its backbone, doubled.

From a reversal at (e_r, f_r) the force goes on as f_r + 2 F((e - e_r)/2), F the odd backbone, and closes earlier loops
where it meets them.  A concave backbone makes a network of sliders that follows the rule on every path: where F's slope
falls by k at x, a spring k slips at the force k x.
"""

from collections.abc import Callable

import numpy as np

from twin.joint.law import Series, Stiffness
from twin.joint.sliders import ParallelJenkins

NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def masing(backbone: Callable[[Series], Series], *, limit_m: float, sliders: int = 20) -> ParallelJenkins:
    """The law with a given backbone, straight between so many points.

    Parameters
    ----------
    backbone
        Force on first loading, from F(0) = 0, rising ever less.
    limit_m
        Deflection up to which the backbone is followed; beyond, it goes on with its last slope.
    sliders
        How many, with equal distances between the deflections at which they slip.

    Raises
    ------
    ValueError
        If the backbone is not concave, so that no sliders make it.
    """
    x = np.linspace(0.0, limit_m, sliders + 1)
    return masing_of_points(x, np.asarray(backbone(x)))


def masing_of_points(deflection_m: Series, force_N: Series) -> ParallelJenkins:
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


def masing_stiffness(amplitude: Series | float, backbone: Callable[[Series], Series]) -> Stiffness:
    """Describing function over a backbone.

    On the loop of amplitude A, e = A sin(theta), the loading branch is -F(A) + 2 F((e + A)/2), which gives the storage
    ``(1/(pi A)) 2 integral f sin(theta)`` over it; the loop encloses ``8 integral_0^A F - 4 A F(A) = pi A^2 Im N``.
    """
    A = np.asarray(amplitude, float)
    theta = NODES * np.pi / 2
    half = A[..., None] * (1.0 + np.sin(theta)) / 2.0
    loading = 2.0 * backbone(half) - backbone(A)[..., None]
    storage = np.sum(WEIGHTS * loading * np.sin(theta), axis=-1) / A
    under = np.sum(WEIGHTS * backbone(A[..., None] * (NODES + 1.0) / 2.0), axis=-1) * A / 2.0
    loss = (8.0 * under - 4.0 * A * backbone(A)) / (np.pi * A**2)
    return np.asarray(storage + 1j * loss, complex)
