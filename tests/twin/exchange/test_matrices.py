"""Matrices of a rig for other programs: read back by pyyeti, scipy and the project's own import."""

import numpy as np
import pytest
from scipy.io import mmread
from scipy.linalg import eigh
from scipy.sparse import load_npz

from recordings.errors import InputError
from twin.exchange.matrices import write_matrices
from twin.rigs import load_rig
from twin.structure.modelled_rig import modelled_rig


def written(tmp_path, suffix, rig="two-lap-joints"):
    paths = [tmp_path / f"{name}{suffix}" for name in ("M", "K")]
    write_matrices(load_rig(rig), *paths, tmp_path / "nodes.csv")
    return paths


def frequencies(M, K):
    values = eigh(np.asarray(K), np.asarray(M), eigvals_only=True, subset_by_index=(0, 5))
    return np.sqrt(np.maximum(values, 0)) / (2 * np.pi)


@pytest.fixture(scope="module")
def known_Hz():
    return modelled_rig(load_rig("two-lap-joints")).modes.frequency_Hz[:6]


@pytest.mark.parametrize(
    ("suffix", "read"), [(".mtx", lambda p: mmread(p).toarray()), (".npz", lambda p: load_npz(p).toarray())]
)
def test_scipy_reads_them(tmp_path, suffix, read, known_Hz):
    np.testing.assert_allclose(frequencies(*map(read, written(tmp_path, suffix))), known_Hz, rtol=1e-6)


def test_pyyeti_reads_output4(tmp_path, known_Hz):
    from pyyeti.nastran import op4

    mass, stiffness = written(tmp_path, ".op4")
    M, K = op4.read(str(mass))["m"], op4.read(str(stiffness))["k"]
    np.testing.assert_allclose(frequencies(M, K), known_Hz, rtol=1e-6)


def test_the_table_says_whose_the_rows_are(tmp_path):
    _, stiffness = written(tmp_path, ".npz", "hung-lap-joint")
    table = np.genfromtxt(tmp_path / "nodes.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    K = load_npz(stiffness).toarray()
    assert list(table["row"]) == list(range(len(K)))
    # Hung free: a rigid translation across the beams strains nothing.
    across = np.where(table["dof"] == "y", 1.0, 0.0)
    assert np.abs(K @ across).max() < 1e-6 * np.abs(K).max()


def test_a_reduced_part_is_refused(tmp_path):
    with pytest.raises(InputError, match="reduced"):
        written(tmp_path, ".mtx", "stiffened-plate")
    assert not list(tmp_path.iterdir())
