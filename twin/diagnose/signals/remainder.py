"""What least squares leaves of long signals, in memory for some thousand of their samples."""

from collections.abc import Callable, Iterator
from itertools import tee

import numpy as np

from twin.arrays import Array
from twin.diagnose.signals.limits import LIMITS


def remainders(
    count: int, values: Callable[[Array], Array], columns: Callable[[Array], Array]
) -> Iterator[tuple[Array, Array]]:
    """Numbers (n,) of samples, and what the columns leave of the values there, (n, v), part by part.

    Parameters
    ----------
    count
        How many samples there are.
    values, columns
        At given numbers of samples, (n, v) and (n, c).
    """

    def parts() -> Iterator[tuple[Array, Array, Array]]:
        for first in range(0, count, LIMITS.remainder_rows):
            at = np.arange(first, min(first + LIMITS.remainder_rows, count))
            yield at, values(at), columns(at)

    once, again = tee(parts()) if count <= LIMITS.remainder_rows else (parts(), parts())
    gram, right = np.zeros(()), np.zeros(())
    for _, some, basis in once:
        gram, right = gram + basis.T @ basis, right + basis.T @ some
    # Columns may coincide, such as a foreign line's and a harmonic's.
    solution = np.linalg.lstsq(gram, right, rcond=LIMITS.remainder_alike)[0]
    for at, some, basis in again:
        yield at, some - basis @ solution
