"""Reduced parts behave like whole ones: chains with known frequencies, a plate and its full matrices, and the cache."""

import importlib

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_array, diags, kron, lil_array

from twin.rigs.matrix_files import PartMatrices
from twin.structure.craig_bampton import cached_craig_bampton, craig_bampton

MODULE = importlib.import_module("twin.structure.craig_bampton")
NX, NY = 12, 8


def frequencies(M, K):
    return np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi)


def chain(n, *, k=1e6, m=0.01, ends="held"):
    """n masses between n - 1 springs, and n + 1 where both ends are held."""
    K = diags([-k, 2 * k, -k], [-1, 0, 1], shape=(n, n)).tolil()
    for end in {"held": (), "free": (0, n - 1), "left held": (n - 1,)}[ends]:
        K[end, end] = k
    return csr_array(diags([m], [0], shape=(n, n))), csr_array(K)


def hermite(n, length):
    """Assembled integrals along n cubic elements: of the squares of H, H' and H'', and of H times H''."""
    h = length / n
    points, weights = np.polynomial.legendre.leggauss(4)
    x, weights = (points + 1) / 2, weights * h / 2
    H = np.array([1 - 3 * x**2 + 2 * x**3, h * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, h * (x**3 - x**2)])
    H1 = np.array([-6 * x + 6 * x**2, h * (1 - 4 * x + 3 * x**2), 6 * x - 6 * x**2, h * (3 * x**2 - 2 * x)]) / h
    H2 = np.array([12 * x - 6, h * (6 * x - 4), 6 - 12 * x, h * (6 * x - 2)]) / h**2
    whole = []
    for a, b in ((H, H), (H1, H1), (H2, H2), (H, H2)):
        A = lil_array((2 * n + 2, 2 * n + 2))
        for e in range(n):
            A[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += (a * weights) @ b.T
        whole.append(A.tocsr())
    return whole


def plate(nx=NX, ny=NY, *, E=70e9, nu=0.33, rho=2700.0, thickness=0.004):
    """A free plate of 0.4 m x 0.3 m in bicubic elements; deflection, its slopes and its twist at each node."""
    (x0, x1, x2, x02), (y0, y1, y2, y02) = hermite(nx, 0.4), hermite(ny, 0.3)
    D = E * thickness**3 / 12 / (1 - nu**2)
    bending = kron(x2, y0) + kron(x0, y2) + nu * (kron(x02, y02.T) + kron(x02.T, y02)) + 2 * (1 - nu) * kron(x1, y1)
    return csr_array(rho * thickness * kron(x0, y0)), csr_array(D * bending)


def deflection(i, j):
    return 2 * i * (2 * NY + 2) + 2 * j


POINTS = [deflection(0, 0), deflection(1, 0), deflection(0, 1), deflection(8, 5), deflection(NX, NY)]


@pytest.mark.parametrize("n", [150, 1000], ids=["all modes at once", "by iteration"])
def test_a_part_without_boundary_has_the_frequencies_of_a_string(n):
    top = 1000 / n * 150
    reduced = craig_bampton(*chain(n), [], modes_to_Hz=top)
    exact = 2 * np.sqrt(1e6 / 0.01) * np.sin(np.arange(1, n + 1) * np.pi / 2 / (n + 1)) / (2 * np.pi)
    exact = exact[exact <= MODULE.KEPT_TO * top]
    assert len(exact) > 40
    np.testing.assert_allclose(frequencies(reduced.M, reduced.K), exact, rtol=1e-8)


def test_modes_of_equal_frequency_are_all_found():
    M, K = (block_diag([A] * 4, format="csr") for A in chain(300, ends="free"))
    one = 2 * np.sqrt(1e6 / 0.01) * np.sin(np.arange(300) * np.pi / 600) / (2 * np.pi)
    reduced = craig_bampton(M, K, [], modes_to_Hz=100.0)
    exact = np.repeat(one[one <= MODULE.KEPT_TO * 100.0], 4)
    np.testing.assert_allclose(frequencies(reduced.M, reduced.K), exact, rtol=1e-8, atol=0.01)


@pytest.mark.parametrize(
    "boundary",
    [POINTS, POINTS[:1], [deflection(0, j) + slope for j in range(NY + 1) for slope in (0, 2 * NY + 2)], []],
    ids=["points", "one point", "an edge with its slopes", "nothing"],
)
def test_a_floating_plate_keeps_its_frequencies_and_its_responses(boundary):
    M, K = plate()
    top = 1500.0
    reduced = craig_bampton(M, K, boundary, modes_to_Hz=top)
    values, Phi = eigh(K.toarray(), M.toarray())
    whole = np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)
    below = int(np.count_nonzero(whole <= top))
    few_values, few = eigh(reduced.K, reduced.M)
    found = np.sqrt(np.maximum(few_values, 0.0)) / (2 * np.pi)
    assert len(found) < len(whole) / 4
    assert np.all(found[:3] < 0.02)
    np.testing.assert_allclose(found[3:below], whole[3:below], rtol=1e-5)
    b = len(boundary)
    for f in (whole[3 : below - 1] + whole[4:below]) / 2:
        if min(abs(f / whole[3:below] - 1)) < 0.01:
            continue
        s = (2 * np.pi * f) ** 2
        H, H_few = (
            (rows / (eigenvalues * (1 + 0.01j) - s)) @ rows.T
            for rows, eigenvalues in ((Phi[boundary], values), (few[:b], few_values))
        )
        own = np.sqrt(np.abs(np.diag(H)))
        assert np.all(np.abs(H_few - H) <= 1e-3 * np.outer(own, own))


def test_the_boundary_comes_first_and_every_row_can_be_recovered():
    M, K = plate()
    reduced = craig_bampton(M, K, POINTS, modes_to_Hz=800.0)
    np.testing.assert_array_equal(reduced.T[POINTS], np.eye(len(POINTS), len(reduced.M)))
    np.testing.assert_allclose(reduced.M, reduced.T.T @ M.toarray() @ reduced.T, atol=1e-12)
    Phi = eigh(K.toarray(), M.toarray(), subset_by_index=[3, 6])[1]
    q = eigh(reduced.K, reduced.M, subset_by_index=[3, 6])[1]
    shapes = reduced.T @ q
    shapes *= np.sign(np.sum(shapes * (M @ Phi), axis=0))
    deflections = [deflection(i, j) for i in range(NX + 1) for j in range(NY + 1)]
    np.testing.assert_allclose(shapes[deflections], Phi[deflections], atol=1e-4)


def test_static_deflection_is_exact():
    """Eight springs in a row: a force at the last mass moves the j-th by j / k."""
    M, K = chain(8, ends="left held")
    reduced = craig_bampton(M, K, [7, 2], modes_to_Hz=1.0)
    assert len(reduced.M) == 2
    flexibility = np.linalg.inv(reduced.K)
    np.testing.assert_allclose(flexibility, np.array([[8, 3], [3, 3]]) / 1e6, rtol=1e-9)
    np.testing.assert_allclose(reduced.T @ flexibility[0], np.arange(1, 9) / 1e6, rtol=1e-9)


@pytest.mark.parametrize("n", [40, 700], ids=["all modes at once", "by iteration"])
def test_rows_without_mass_follow_the_others(n):
    """Masses with a bare joint between any two are a chain of springs half as stiff."""
    top = 200.0 * 40 / n
    reduced = craig_bampton(*bare(n), [0], modes_to_Hz=top)
    exact = 2 * np.sqrt(5e5 / 0.01) * np.sin(np.arange(n) * np.pi / 2 / n) / (2 * np.pi)
    exact = exact[exact <= top]
    np.testing.assert_allclose(frequencies(reduced.M, reduced.K)[: len(exact)], exact, rtol=1e-5, atol=1e-3)


def bare(n):
    """A free chain of n masses; between any two stands a row without mass."""
    M, K = chain(2 * n - 1, ends="free")
    mass = M.diagonal()
    mass[1::2] = 0.0
    return csr_array(diags(mass)), K


def test_all_modes_and_no_more_where_all_lie_below():
    """Nothing is left for residual vectors, and rounding must not take their place."""
    M, K = chain(30, ends="free")
    reduced = craig_bampton(M, K, [0, 29], modes_to_Hz=1e4)
    assert len(reduced.M) == 30
    np.testing.assert_allclose(
        frequencies(reduced.M, reduced.K), frequencies(M.toarray(), K.toarray()), rtol=1e-9, atol=1e-3
    )


def test_rows_that_nothing_belongs_to_stay_at_rest():
    M, K = (block_diag([A, csr_array((2, 2))], format="csr") for A in chain(20))
    reduced = craig_bampton(M, K, [4], modes_to_Hz=300.0)
    assert not np.any(reduced.T[20:])
    np.testing.assert_allclose(reduced.M, craig_bampton(*chain(20), [4], modes_to_Hz=300.0).M)


def test_a_part_that_is_all_boundary_is_itself():
    M, K = chain(5)
    reduced = craig_bampton(M, K, [4, 3, 2, 1, 0], modes_to_Hz=100.0)
    np.testing.assert_array_equal(reduced.K, K.toarray()[::-1, ::-1])


def test_twice_the_same_is_the_same_to_the_last_bit():
    M, K = chain(1000, ends="free")
    first, second = (craig_bampton(M, K, [0, 500], modes_to_Hz=60.0).T for _ in range(2))
    np.testing.assert_array_equal(first, second)
    modes = first[:, 2:8]
    assert np.all(modes[np.abs(modes).argmax(axis=0), np.arange(6)] > 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"boundary": [20]}, "must lie in 0 ... 19, each once"),
        ({"boundary": [-1]}, "must lie in 0 ... 19, each once"),
        ({"boundary": [3, 3]}, "must lie in 0 ... 19, each once"),
        ({"modes_to_Hz": 0.0}, "must be above zero"),
        ({"modes_to_Hz": np.inf}, "must be above zero"),
        ({"K": -chain(20)[1]}, "not positive semidefinite"),
        ({"M": csr_array((20, 20)), "K": chain(20, ends="free")[1], "boundary": []}, "singular beyond rigid motions"),
    ],
)
def test_what_cannot_be_reduced_is_refused(change, message):
    M, K = chain(20)
    case = {"M": M, "K": K, "boundary": [0], "modes_to_Hz": 500.0, **change}
    with pytest.raises(ValueError, match=message):
        craig_bampton(case.pop("M"), case.pop("K"), case.pop("boundary"), **case)


def test_a_reduction_to_very_many_modes_is_refused():
    with pytest.raises(ValueError, match="over 600 modes to keep up to 22500 Hz"):
        craig_bampton(*chain(700), [0], modes_to_Hz=1e4)


@pytest.fixture
def part():
    M, K = chain(40, ends="free")
    nodes = np.arange(40)
    return PartMatrices(M, K, nodes, np.zeros((40, 3)), {(i, "x"): i for i in range(40)})


@pytest.fixture
def computed(monkeypatch):
    """How often a basis was computed."""
    count = []
    true = MODULE._basis
    monkeypatch.setattr(MODULE, "_basis", lambda *args: count.append(1) or true(*args))
    return count


def test_a_second_reduction_comes_from_the_cache(part, computed, tmp_path):
    first = cached_craig_bampton(part, [0, 39], modes_to_Hz=300.0, folder=tmp_path)
    second = cached_craig_bampton(part, np.array([0, 39]), modes_to_Hz=300, folder=tmp_path)
    assert len(computed) == 1
    assert [path.suffix for path in (tmp_path / ".twin-cache").iterdir()] == [".npz"]
    direct = craig_bampton(part.M, part.K, [0, 39], modes_to_Hz=300.0)
    for name in ("M", "K", "T"):
        np.testing.assert_array_equal(getattr(second, name), getattr(first, name))
        np.testing.assert_array_equal(getattr(direct, name), getattr(first, name))


def test_nothing_is_kept_without_a_folder(part, computed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        cached_craig_bampton(part, [0], modes_to_Hz=300.0, folder=None)
    assert len(computed) == 2
    assert not list(tmp_path.iterdir())


def test_another_question_is_another_file(part, computed, tmp_path):
    stiffer = PartMatrices(part.M, 2 * part.K, part.nodes, part.coordinates, part.rows)
    for asked, boundary, top in (
        (part, [0], 300.0), (part, [1], 300.0), (part, [0, 1], 300.0), (part, [0], 301.0), (stiffer, [0], 300.0),
    ):  # fmt: skip
        cached_craig_bampton(asked, boundary, modes_to_Hz=top, folder=tmp_path)
    assert len(computed) == len(list((tmp_path / ".twin-cache").iterdir())) == 5


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "pickle", "other rows", "not finite", "a folder"])
def test_a_damaged_cache_is_computed_anew(part, computed, tmp_path, damage):
    good = cached_craig_bampton(part, [0, 39], modes_to_Hz=300.0, folder=tmp_path)
    (path,) = (tmp_path / ".twin-cache").iterdir()
    data = path.read_bytes()
    if damage == "cut":
        path.write_bytes(data[: len(data) // 2])
    elif damage == "flipped":
        middle = len(data) // 2
        path.write_bytes(data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :])
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "pickle":
        np.savez(path, T=np.array([print, None], dtype=object))
    elif damage == "a folder":
        path.unlink()
        path.mkdir()
    else:
        T = good.T[::-1].copy() if damage == "other rows" else good.T.copy()
        T[20, 0] = 0.0 if damage == "other rows" else np.nan
        np.savez(path, T=T, error=good.error)
    again = cached_craig_bampton(part, [0, 39], modes_to_Hz=300.0, folder=tmp_path)
    np.testing.assert_array_equal(again.T, good.T)
    assert len(computed) == 2
    cached_craig_bampton(part, [0, 39], modes_to_Hz=300.0, folder=tmp_path)
    assert len(computed) == (3 if damage == "a folder" else 2), "what was damaged is replaced"


def test_a_cache_that_cannot_be_written_is_no_error(part, computed, tmp_path):
    (tmp_path / ".twin-cache").write_text("in the way")
    for folder in (tmp_path, tmp_path / "no such folder"):
        assert len(cached_craig_bampton(part, [0], modes_to_Hz=300.0, folder=folder).M) > 1
    assert [path.name for path in tmp_path.iterdir()] == [".twin-cache"]


def test_the_error_of_a_reduction_is_that_of_the_whole_parts_frequencies(part):
    """Against all modes at once; a basis of too few modes is noticed, and more are kept."""
    reduced = craig_bampton(part.M, part.K, [0, 39], modes_to_Hz=300.0)
    whole, few = (
        np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi)
        for M, K in ((part.M.toarray(), part.K.toarray()), (reduced.M, reduced.K))
    )
    asked = (whole > 0.3) & (whole < 300.0)
    errors = np.abs(few[: len(whole)][asked[: len(few)]] / whole[asked] - 1)
    assert len(errors) >= 2
    assert reduced.error == pytest.approx(errors.max(), abs=1e-9)
    assert reduced.error < 1e-4


def test_a_reduction_that_keeps_too_little_keeps_more_or_is_refused(part, monkeypatch):
    monkeypatch.setattr(MODULE, "_residual_vectors", lambda M, K, Phi, inertia, *_: inertia[:, :0])
    plenty = craig_bampton(part.M, part.K, [0, 39], modes_to_Hz=60.0).error
    assert plenty <= 1e-4 or np.isnan(plenty)
    monkeypatch.setattr(MODULE, "KEPT_TO", 0.3)
    with pytest.raises(ValueError, match="its natural frequencies up to 300 Hz are off by"):
        craig_bampton(part.M, part.K, [0, 39], modes_to_Hz=300.0)
