"""Newton's correction at many places whose tangents seldom change: sliders stick or slip, gaps are open or closed.

With tangents T and the step's flexibility D the correction is (1 - D T)^-1 r = r + S T r, S = (1 - D T)^-1 D.  One
tangent that changes by d alters S by d S_b S_b' / (1 - d S_bb), S_b its column and row at that place: a step costs
places squared, where an elimination would cost places cubed.  S decides how fast Newton converges and not to what: a
change that no place would feel, each in its own size, is not followed.
"""

import numpy as np

from twin.arrays import Array
from twin.bench.limits import LIMITS
from twin.joint.kernel import COMPILED

CHANGED, SLOW = LIMITS.many_changed, LIMITS.many_slow


@COMPILED
def correct(
    D: Array, tangent: Array, kept: Array, S: Array, size: Array, r: Array, iteration: int
) -> None:  # fmt: skip
    """Replace the residual r, (n,), by Newton's correction.

    Parameters
    ----------
    D : ndarray, (>= n, 1 + n)
        Flexibility of the step, the local forces from the second column on.
    tangent : ndarray, (n,)
        Of the forces now.
    kept, S : ndarray, (n,), (n, n)
        The tangents of S and S itself, moved on in place.
    size : ndarray, (n,)
        Of the coordinates, which may be displacements at some places and velocities at others.
    iteration : int
        Newton's in this step; the very first call is to have S = 0.
    """
    n = r.shape[0]
    if iteration % SLOW == SLOW - 1 or S[0, 0] == 0.0:
        for a in range(n):
            kept[a] = 0.0
            for b in range(n):
                S[a, b] = D[a, 1 + b]
    for b in range(n):
        change = tangent[b] - kept[b]
        if change == 0.0:
            continue
        felt = 0.0
        for a in range(n):
            felt = max(felt, abs(S[a, b]) / size[a])
        if abs(change) * felt * size[b] > CHANGED:
            scale = change / (1.0 - change * S[b, b])
            for a in range(n):
                if a != b:
                    factor = scale * S[a, b]
                    for c in range(n):
                        S[a, c] += factor * S[b, c]
            factor = 1.0 + scale * S[b, b]
            for c in range(n):
                S[b, c] *= factor
            kept[b] = tangent[b]
    held = np.empty(n)
    for b in range(n):
        held[b] = kept[b] * r[b]
    for a in range(n):
        total = 0.0
        for b in range(n):
            total += S[a, b] * held[b]
        r[a] += total
