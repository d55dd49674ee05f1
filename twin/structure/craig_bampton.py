"""A part of many degrees of freedom in few: after Craig and Bampton, with residual vectors.

Static shapes of the boundary and modes with the boundary held converge slowly on their own: on an aluminium plate, with
a few points or an edge as its boundary, modes up to 3 times the highest frequency of interest left natural frequencies
up to 1e-3 off, and frequency responses between resonances 20 %.  With residual vectors, the static answer to the
inertia of each static shape as far as the modes leave it out, and modes up to `KEPT_TO` times that frequency, it was
3e-6 and 7e-4; with modes up to 1.5 times, 7e-5 and 1e-2.
"""

import contextlib
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from recordings.errors import InputError
from recordings.whole import whole_file
from twin.arrays import Array
from twin.rigs.matrix_files import PartMatrices
from twin.structure.limits import LIMITS

Solve = Callable[[Array], Array]

KEPT_TO = 2.25
"""Modes with the boundary held are kept to this multiple of the highest frequency of interest."""
SHIFT = 1e-4
"""Of the highest eigenvalue kept: makes the stiffness of a floating part regular and leaves its accuracy alone."""
BLOCK = 64
CACHE_FOLDER, CACHE_FORMAT = ".twin-cache", 2


@dataclass(frozen=True, eq=False)
class ReducedPart:
    """A part in r coordinates q, x = T q: the b displacements of its boundary, then modes, then residual vectors."""

    M: Array
    K: Array
    """T' M T and T' K T, (r, r)."""
    T: Array
    """All rows of the part, in the order of its matrices, (n, r)."""
    error: float
    """Largest relative error of its natural frequencies up to the highest of interest, hung free of its boundary."""


def craig_bampton(M: csr_array, K: csr_array, boundary: Sequence[int] | Array, *, modes_to_Hz: float) -> ReducedPart:
    """Reduce a part, held or floating, to its boundary and its fixed-interface modes.

    ValueError if a row is not one of the matrices', the frequency is not above zero, the stiffness is singular beyond
    rigid motions or not positive semidefinite, more than `LIMITS.modes_limit` modes would have to be kept, or the
    natural frequencies of the whole part are not met.

    Parameters
    ----------
    M, K : sparse, (n, n)
        Symmetric, positive semidefinite; kg and N/m, for rotations kg m2 and N m/rad.
    boundary : (b,)
        Rows of the degrees of freedom that stay as they are, each once; none at all gives the part's own modes.
    modes_to_Hz
        Up to which frequency the reduced part must behave like the whole one.
    """
    M, K, rows = csr_array(M, dtype=float), csr_array(K, dtype=float), _rows(boundary, M.shape[0])
    for kept_to in (KEPT_TO, 2 * KEPT_TO):
        reduced = _reduced(M, K, _basis(M, K, rows, modes_to_Hz, kept_to))
        reduced = replace(reduced, error=_error(M, K, reduced, modes_to_Hz))
        if reduced.error <= LIMITS.craig_bampton_off:
            return reduced
    raise ValueError(
        f"reduced, its natural frequencies up to {modes_to_Hz:g} Hz are off by {reduced.error:.1g}, "
        f"beyond {LIMITS.craig_bampton_off:g}"
    )


def cached_craig_bampton(
    part: PartMatrices, boundary: Sequence[int] | Array, *, modes_to_Hz: float, folder: Path | None
) -> ReducedPart:
    """As :func:`craig_bampton`, kept in the folder ``.twin-cache`` of `folder` for the next time; None keeps nothing.

    A cache that cannot be read or written, or is damaged, is as good as none.  ValueError as :func:`craig_bampton`.
    """
    if folder is None:
        return craig_bampton(part.M, part.K, boundary, modes_to_Hz=modes_to_Hz)
    rows = _rows(boundary, part.M.shape[0])
    path = folder / CACHE_FOLDER / f"{_digest(part, rows, modes_to_Hz)}.npz"
    known = _stored(path, part.M.shape[0], rows)
    if known is not None:
        return replace(_reduced(part.M, part.K, known[0]), error=known[1])
    reduced = craig_bampton(part.M, part.K, rows, modes_to_Hz=modes_to_Hz)
    _store(path, reduced)
    return reduced


def _rows(boundary: Sequence[int] | Array, n: int) -> Array:
    rows = np.array(boundary, dtype=np.int64).reshape(-1)
    if np.any((rows < 0) | (rows >= n)) or len(np.unique(rows)) < len(rows):
        raise ValueError(f"the boundary's rows must lie in 0 ... {n - 1}, each once")
    return rows


def _reduced(M: csr_array, K: csr_array, T: Array) -> ReducedPart:
    few_M, few_K = (T.T @ (A @ T) for A in (M, K))
    return ReducedPart((few_M + few_M.T) / 2, (few_K + few_K.T) / 2, T, np.nan)


def _error(M: csr_array, K: csr_array, reduced: ReducedPart, modes_to_Hz: float) -> float:
    """Largest relative error of the reduced part's elastic natural frequencies up to the highest of interest."""
    limit = (2 * np.pi * modes_to_Hz) ** 2
    kept = np.flatnonzero(np.asarray((abs(M) + abs(K)).sum(axis=1)).ravel() > 0)
    whole_M, whole_K = (csc_array(A[kept][:, kept]) for A in (M, K))
    shift = SHIFT * limit
    Phi = _modes_below(limit, whole_M, whole_K, shift=shift, solve=_factorised(csc_array(whole_K + shift * whole_M)))
    exact = np.sort(np.einsum("ij,ij->j", Phi, whole_K @ Phi))
    exact = exact[exact > LIMITS.craig_bampton_elastic**2 * limit]
    held = np.diag(reduced.M) > 0  # a row without mass follows the others at once
    few_M, few_K = reduced.M[np.ix_(held, held)], reduced.K[np.ix_(held, held)]
    if not np.all(held):
        loose = reduced.K[np.ix_(~held, ~held)], reduced.K[np.ix_(~held, held)]
        few_K = few_K - loose[1].T @ np.linalg.lstsq(*loose, rcond=None)[0]
    found = 1 / eigh(few_M, few_K + shift * few_M, eigvals_only=True)[::-1] - shift
    found = found[found > LIMITS.craig_bampton_elastic**2 * limit][: len(exact)]
    if len(found) < len(exact):
        return np.inf
    return float(np.max(np.abs(np.sqrt(found / exact) - 1), initial=0.0))


def _basis(M: csr_array, K: csr_array, boundary: Array, modes_to_Hz: float, kept_to: float) -> Array:
    """T of :class:`ReducedPart`; rows inside that have neither mass nor stiffness stay at rest."""
    if not 0 < modes_to_Hz < np.inf:
        raise ValueError(f"modes up to {modes_to_Hz:g} Hz: must be above zero")
    n, b = M.shape[0], len(boundary)
    inside = np.asarray((abs(M) + abs(K)).sum(axis=1)).ravel() > 0
    inside[boundary] = False
    inner = np.flatnonzero(inside)
    limit = (2 * np.pi * kept_to * modes_to_Hz) ** 2
    static, modes = np.zeros((0, b)), np.zeros((0, 0))
    if len(inner):
        M_i, K_i = (csc_array(A[inner][:, inner]) for A in (M, K))
        shift = SHIFT * limit
        solve = _factorised(csc_array(K_i + shift * M_i))
        Phi = _modes_below(limit, M_i, K_i, shift=shift, solve=solve)
        static = _static_shapes(K_i, csc_array(K[inner][:, boundary]), solve)
        inertia = M_i @ static + M[inner][:, boundary]
        modes = np.hstack([Phi, _residual_vectors(M_i, K_i, Phi, inertia, solve, limit)])
    T = np.zeros((n, b + modes.shape[1]))
    T[boundary, np.arange(b)] = 1.0
    T[inner, :b] = static
    T[inner, b:] = modes
    if not np.all(np.isfinite(T)):
        raise ValueError("the stiffness is singular beyond rigid motions")
    return T


def _factorised(A: csc_array) -> Solve:
    try:
        lu = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise ValueError("the stiffness is singular beyond rigid motions") from error
    return lu.solve


def _static_shapes(K: csc_array, K_boundary: csc_array, solve: Solve) -> Array:
    """Motion inside by unit motions of the boundary, (n, b); `solve` is by the shifted stiffness, hence two steps."""
    shapes = np.empty(K_boundary.shape)
    for first in range(0, shapes.shape[1], BLOCK):
        load = -K_boundary[:, first : first + BLOCK].toarray()
        shape = solve(load)
        shapes[:, first : first + BLOCK] = shape + solve(load - K @ shape)
    return shapes


def _residual_vectors(M: csc_array, K: csc_array, Phi: Array, inertia: Array, solve: Solve, limit: float) -> Array:
    """What the modes Phi, up to `limit`, leave out of the static answer to loads `inertia`: its Ritz vectors."""
    if not inertia.shape[1]:
        return inertia
    modal = Phi.T @ inertia
    Z = solve(inertia - M @ (Phi @ modal))
    Z -= Phi @ (Phi.T @ (M @ Z))
    size = np.sqrt(np.maximum(np.einsum("ij,ij->j", Z, M @ Z), 0.0))
    felt = size > LIMITS.craig_bampton_noise * np.linalg.norm(modal, axis=0) / limit
    if not np.any(felt):
        return Z[:, :0]
    Z = Z[:, felt] / size[felt]
    Z -= Phi @ (Phi.T @ (M @ Z))
    mass, axes = eigh(Z.T @ (M @ Z))
    Z = Z @ (axes[:, mass > 1e-10] / np.sqrt(mass[mass > 1e-10]))
    values, vectors = eigh(Z.T @ (K @ Z))
    return np.asarray(Z @ vectors[:, values <= LIMITS.residual_to**2 * limit])


def _modes_below(limit: float, M: csc_array, K: csc_array, *, shift: float, solve: Solve) -> Array:
    """All mass-normalised modes with eigenvalues up to `limit`, (n, m), rising; of each the largest entry is positive.

    Rounds of iterations, each among what the former ones left, end when the lowest of a round lies above the limit:
    one iteration alone can miss one of two modes of equal frequency.
    """
    massive = np.flatnonzero(M.diagonal() > 0)
    Phi, values = np.zeros((M.shape[0], 0)), np.zeros(0)
    count = 16
    while True:
        if len(massive) <= LIMITS.dense_order or 2 * (len(values) + count) > len(massive):
            values, Phi = _all_modes(M, massive, shift, solve)
            new = values
        else:
            new, more = _next_modes(M, K, values, Phi, count, shift=shift, solve=solve)
            values, Phi = np.concatenate([values, new]), np.hstack([Phi, more])
        if np.any((new < -shift) & (new > -limit)):
            raise ValueError("the stiffness is not positive semidefinite; was it written with too few digits?")
        kept = (values >= -shift) & (values <= limit)
        if np.count_nonzero(kept) > LIMITS.modes_limit:
            raise ValueError(f"over {LIMITS.modes_limit} modes to keep up to {np.sqrt(limit) / (2 * np.pi):g} Hz")
        below = (new >= -shift) & (new <= limit)
        if new is values or not np.any(below):
            break
        count = 2 * count if np.all(below) else 4
    Phi = Phi[:, kept][:, np.argsort(values[kept], kind="stable")]
    largest = np.abs(Phi).argmax(axis=0) if len(Phi) else np.zeros(0, int)
    return np.asarray(Phi * np.where(Phi[largest, np.arange(Phi.shape[1])] < 0, -1.0, 1.0))


def _next_modes(
    M: csc_array, K: csc_array, values: Array, Phi: Array, count: int, *, shift: float, solve: Solve
) -> tuple[Array, Array]:
    """The lowest `count` eigenvalues and modes among those that are not in `Phi`."""
    n = M.shape[0]
    gain = 1 / (values + shift)

    def others(load: Array) -> Array:
        load = np.asarray(load).ravel()
        return solve(load) - Phi @ (gain * (Phi.T @ load))

    start = others(M @ np.random.default_rng(0).standard_normal(n))
    inverse = LinearOperator((n, n), matvec=others, dtype=float)
    try:
        new, more = eigsh(K, k=count, M=M, sigma=-shift, v0=start, OPinv=inverse)
    except ArpackError as error:
        raise ValueError(f"the modes with the boundary held were not found: {error}") from error
    return new, more


def _all_modes(M: csc_array, massive: Array, shift: float, solve: Solve) -> tuple[Array, Array]:
    """All eigenvalues and modes, by the flexibility between the rows that have mass."""
    if not len(massive):
        return np.zeros(0), np.zeros((M.shape[0], 0))
    mass, axes = eigh(M[massive][:, massive].toarray())
    L = np.zeros((M.shape[0], len(massive)))
    L[massive] = axes * np.sqrt(np.maximum(mass, 0.0))
    motion = solve(L)
    flexibility = L.T @ motion
    gain, z = eigh((flexibility + flexibility.T) / 2)
    felt = np.abs(gain) > 1e-14 * np.max(np.abs(gain), initial=0.0)
    gain = gain[felt]
    return 1 / gain - shift, motion @ (z[:, felt] / gain)


def _digest(part: PartMatrices, boundary: Array, modes_to_Hz: float) -> str:
    """Name of all that the basis depends on."""
    digest = hashlib.blake2b(digest_size=20)
    digest.update(
        repr((CACHE_FORMAT, part.M.shape, len(boundary), float(modes_to_Hz), KEPT_TO, LIMITS.residual_to)).encode()
    )
    for A in (part.M, part.K):
        for array, kind in ((A.indptr, np.int64), (A.indices, np.int64), (A.data, np.float64)):
            digest.update(np.ascontiguousarray(array, dtype=kind).data)
    digest.update(boundary.data)
    return digest.hexdigest()


def _stored(path: Path, n: int, boundary: Array) -> tuple[Array, float] | None:
    """The basis in a cache file and its error, or None if there is none or it cannot be one."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            T, error = arrays["T"], float(arrays["error"])
        b = len(boundary)
        good = T.dtype == np.float64 and T.shape[0] == n and T.ndim == 2 and np.all(np.isfinite(T))
        return (
            (T, error)
            if good and error <= LIMITS.craig_bampton_off and np.array_equal(T[boundary], np.eye(b, T.shape[1]))
            else None
        )
    except Exception:  # numpy lets through whatever a broken file provokes
        return None


def _store(path: Path, reduced: ReducedPart) -> None:
    """Write the basis; the file appears whole or not at all, and not being able to is no error."""
    with contextlib.suppress(OSError, InputError):
        path.parent.mkdir(exist_ok=True)
        with whole_file(path) as part, part.open("wb") as stream:
            np.savez(stream, T=reduced.T, error=reduced.error)
