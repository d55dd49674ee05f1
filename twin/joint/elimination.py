"""Small dense systems inside compiled loops, where a call of LAPACK would cost more than the work."""

from twin.arrays import Array
from twin.joint.compilation import INNER


@INNER
def eliminate(J: Array, r: Array) -> None:
    """Gaussian elimination with row pivoting of a real system; the solution replaces r, (n,)."""
    n = len(r)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(J[i, k]) > abs(J[best, k]):
                best = i
        if best != k:
            for j in range(k, n):
                J[k, j], J[best, j] = J[best, j], J[k, j]
            r[k], r[best] = r[best], r[k]
        for i in range(k + 1, n):
            factor = J[i, k] / J[k, k]
            for j in range(k + 1, n):
                J[i, j] -= factor * J[k, j]
            r[i] -= factor * r[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            r[k] -= J[k, j] * r[j]
        r[k] /= J[k, k]


@INNER
def eliminate_columns(A: Array, right: Array) -> None:
    """The same of a real or complex system with m right sides, (n, m), which the solutions replace."""
    n, m = right.shape
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k].real) + abs(A[i, k].imag) > abs(A[best, k].real) + abs(A[best, k].imag):
                best = i
        if best != k:
            for j in range(k, n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
            for j in range(m):
                right[k, j], right[best, j] = right[best, j], right[k, j]
        inverse = 1.0 / A[k, k]
        for i in range(k + 1, n):
            factor = A[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= factor * A[k, j]
                for j in range(m):
                    right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / A[k, k]
        for j in range(m):
            for i in range(k + 1, n):
                right[k, j] -= A[k, i] * right[i, j]
            right[k, j] *= inverse
