"""Make the files of the rig `stiffened-plate`: two finite-element parts, reduced, and the pairs of nodes between them.

pip install scikit-fem
python docs/make_stiffened_plate.py

Each part is an elastic solid of 27-node hexahedra (scikit-fem), reduced after Craig and Bampton to the nodes that the
rig may use.  Then the script prints natural frequencies: of the bare plate beside a thin plate's after Kirchhoff, and
of the whole rig from both parts as they were before the reduction, which the rig's test holds the project to.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.io import mmwrite
from scipy.linalg import eigh
from scipy.sparse import block_diag, coo_array, csc_array, csr_array, save_npz
from scipy.sparse.linalg import eigsh, splu
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, MeshHex
from skfem.helpers import ddot, dot, eye, sym_grad, trace

Array = NDArray[np.float64]

RIG = Path(__file__).parents[1] / "twin" / "rigs" / "stiffened-plate.toml"
AXES = ("x", "y", "z")

YOUNGS_MODULUS, POISSON, DENSITY = 205e9, 0.3, 7850.0
"""Structural steel, of both parts; N/m2, 1, kg/m3."""
PLATE = (0.360, 0.240, 0.003)
STIFFENER = (0.300, 0.020, 0.012)
"""Along x, y and z, m.  The plate's upper face is z = 0, one of its corners x = y = 0."""
STIFFENER_AT = (0.020, 0.160, 0.0)
"""Its corner nearest to the origin; off the plate's middle in x and y, so that no mode is symmetric."""
ELEMENT = 0.020
"""Edge along x and y; there is one element through each thickness."""
BOLTS = (0.050, 0.170, 0.290)
"""Middles of the bolts' zones along x, each one element wide."""
GRID = (7, 5)
"""Nodes of the plate's upper face that are kept beside those of the joint, along x and y."""
TOP = (0.020, 0.100, 0.170, 0.240, 0.320)
"""Kept nodes on the middle line of the stiffener's upper face, x."""
KEPT_TO = 3.0
"""Modes with the kept nodes held are kept up to so many times the rig file's modes_to_Hz."""
SIMPSON = np.array([1.0, 4.0, 1.0]) / 6
"""Weights of an element's three nodes along one of its edges."""


@dataclass(frozen=True, eq=False)
class Part:
    """A part before the reduction.

    Attributes
    ----------
    M, K : sparse, (n, n)
        Mass and stiffness.
    places : ndarray, (n, 3)
        Where each displacement is, m.
    """

    M: csc_array
    K: csc_array
    places: Array

    def rows(self, place: Sequence[float]) -> list[int]:
        """Displacements of the node at a place, along x, y and z."""
        found = np.flatnonzero(np.abs(self.places - np.array(place)).max(axis=1) < 1e-9)
        if len(found) != 3:
            raise ValueError(f"no node at {place}")
        return found.tolist()


@dataclass(frozen=True, eq=False)
class Kept:
    """A part's kept nodes: number and place, from 1."""

    part: Part
    places: list[tuple[float, float, float]]

    def number(self, place: Sequence[float]) -> int:
        """The node at a place."""
        return int(np.argmin(np.abs(np.array(self.places) - np.array(place)).max(axis=1))) + 1

    @property
    def boundary(self) -> list[int]:
        """Displacements of all kept nodes, three of each."""
        return [row for place in self.places for row in self.part.rows(place)]


@BilinearForm
def mass_form(u: Any, v: Any, _: Any) -> Any:
    """Kinetic energy's form."""
    return DENSITY * dot(u, v)


@BilinearForm
def stiffness_form(u: Any, v: Any, _: Any) -> Any:
    """Strain energy's form of an isotropic solid."""
    shear = YOUNGS_MODULUS / (2 * (1 + POISSON))
    bulk = YOUNGS_MODULUS * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    strain = sym_grad(u)
    return ddot(2 * shear * strain + eye(bulk * trace(strain), 3), sym_grad(v))


def solid(corner: Sequence[float], size: Sequence[float], element: float = ELEMENT) -> Part:
    """A block of 27-node hexahedra, one through its thickness."""
    counts = [round(size[0] / element), round(size[1] / element), 1]
    lines = [c + np.linspace(0, s, n + 1) for c, s, n in zip(corner, size, counts, strict=True)]
    basis = Basis(MeshHex.init_tensor(*lines), ElementVector(ElementHex2()), intorder=4)
    M, K = (csc_array(form.assemble(basis)) for form in (mass_form, stiffness_form))
    return Part((M + M.T) / 2, (K + K.T) / 2, basis.doflocs.T)


def natural_frequencies(M: csc_array, K: csc_array, count: int) -> Array:
    """The lowest natural frequencies of something that hangs free, its six rigid motions left out; Hz."""
    shift = (2 * np.pi * 50) ** 2
    start = np.ones(M.shape[0])
    values = np.sort(eigsh(K, k=count + 6, M=M, sigma=-shift, v0=start, return_eigenvectors=False))
    return np.sqrt(values[6:]) / (2 * np.pi)


def thin_plate(count: int, degree: int = 14) -> Array:
    """Natural frequencies of the free plate after Kirchhoff, by Ritz with products of Legendre polynomials; Hz."""
    a, b, h = PLATE
    bending = YOUNGS_MODULUS * h**3 / (12 * (1 - POISSON**2))
    x, w = legendre.leggauss(degree + 2)
    polynomials = [legendre.Legendre.basis(n) for n in range(degree + 1)]
    values = [np.array([p.deriv(k)(x) if k else p(x) for p in polynomials]) for k in range(3)]

    def product(i: int, j: int, length: float) -> Array:
        return (values[i] * w) @ values[j].T * (length / 2) * (2 / length) ** (i + j)

    X, Y = ({(i, j): product(i, j, size) for i in range(3) for j in range(3)} for size in (a, b))
    stiffness = np.kron(X[2, 2], Y[0, 0]) + np.kron(X[0, 0], Y[2, 2])
    stiffness += POISSON * (np.kron(X[2, 0], Y[0, 2]) + np.kron(X[0, 2], Y[2, 0]))
    stiffness += 2 * (1 - POISSON) * np.kron(X[1, 1], Y[1, 1])
    mass = DENSITY * h * np.kron(X[0, 0], Y[0, 0])
    squares = eigh(bending * stiffness, mass, eigvals_only=True)
    return np.sqrt(squares[3 : 3 + count]) / (2 * np.pi)


def contact() -> list[tuple[tuple[float, float, float], float]]:
    """Places of the joint's nodes, bolt by bolt, and the area each stands for: Simpson's rule over its element."""
    found = []
    for middle in BOLTS:
        for i, along in enumerate(SIMPSON):
            for j, across in enumerate(SIMPSON):
                x = middle + (i - 1) * ELEMENT / 2
                y = STIFFENER_AT[1] + j * STIFFENER[1] / 2
                found.append(((round(x, 6), round(y, 6), 0.0), float(along * across * ELEMENT * STIFFENER[1])))
    return found


def kept_nodes(plate: Part, stiffener: Part) -> tuple[Kept, Kept]:
    """The plate's grid, then what else is of the joint; the stiffener's side of the joint, then its upper face."""
    joint = [place for place, _ in contact()]
    lines = [np.linspace(0, size, count).round(6) for size, count in zip(PLATE, GRID, strict=False)]
    grid = [(float(x), float(y), 0.0) for y in lines[1] for x in lines[0]]
    top = [(x, round(STIFFENER_AT[1] + STIFFENER[1] / 2, 6), STIFFENER[2]) for x in TOP]
    return Kept(plate, list(dict.fromkeys(grid + joint))), Kept(stiffener, joint + top)


def reduced(kept: Kept, limit_Hz: float) -> tuple[csr_array, csr_array]:
    """Mass and stiffness after Craig and Bampton: kept displacements first, then the modes with these held."""
    M, K, boundary = kept.part.M, kept.part.K, kept.boundary
    inside = np.setdiff1d(np.arange(M.shape[0]), boundary)
    M_i, K_i = M[inside][:, inside], K[inside][:, inside]
    static = splu(csc_array(K_i)).solve(-K[inside][:, boundary].toarray())
    count = 16
    while True:
        values, Phi = eigsh(K_i, k=count, M=M_i, sigma=0.0, v0=np.ones(len(inside)))
        if values.max() > (2 * np.pi * limit_Hz) ** 2:
            break
        count *= 2
    order = np.argsort(values)
    Phi = Phi[:, order[values[order] <= (2 * np.pi * limit_Hz) ** 2]]
    largest = Phi[np.abs(Phi).argmax(axis=0), np.arange(Phi.shape[1])]
    T = np.zeros((M.shape[0], len(boundary) + Phi.shape[1]))
    T[boundary, np.arange(len(boundary))] = 1.0
    T[inside] = np.hstack([static, Phi * np.sign(largest)])
    b = len(boundary)
    small = []
    for A in (M, K):
        whole = T.T @ (A @ T)
        whole = (whole + whole.T) / 2
        whole[b:, b:] = np.diag(np.diag(whole)[b:])
        small.append(whole)
    small[1][:b, b:] = small[1][b:, :b] = 0.0  # static shapes do no work on modes with the kept nodes held
    return csr_array(small[0]), csr_array(small[1])


def joint_stiffness(plate: Part, stiffener: Part, normal: float, shear: float, height: float) -> csc_array:
    """Of all pairs, over the plate's displacements and then the stiffener's."""
    n = plate.M.shape[0]
    rows, columns, entries = [], [], []
    for place, area in contact():
        for axis in range(3):
            ends = (plate.rows(place)[axis], n + stiffener.rows(place)[axis])
            stiffness = area / height * (normal if axis == 2 else shear)
            for one in ends:
                for two in ends:
                    rows.append(one)
                    columns.append(two)
                    entries.append(stiffness if one == two else -stiffness)
    size = n + stiffener.M.shape[0]
    return csc_array(coo_array((entries, (rows, columns)), shape=(size, size)))


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A CSV file."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def write_nodes(path: Path, kept: Kept) -> None:
    """The table of a part's nodes."""
    rows = (
        (number, axis, 3 * (number - 1) + k, *place)
        for number, place in enumerate(kept.places, 1)
        for k, axis in enumerate(AXES)
    )
    write_table(path, ("node", "dof", "row", "x_m", "y_m", "z_m"), rows)


def write_files(rig: dict[str, Any], plate: Kept, stiffener: Kept) -> None:
    """All files that the rig file names."""
    files = {part["name"]: part for part in rig["part"]}
    for name, kept in (("plate", plate), ("stiffener", stiffener)):
        part = files[name]
        M, K = reduced(kept, KEPT_TO * part["modes_to_Hz"])
        held = len(kept.boundary)
        print(f"{name}: {kept.part.M.shape[0]} rows, reduced to {held} kept ones and {M.shape[0] - held} modes")
        for file, matrix in ((part["mass"], M), (part["stiffness"], K)):
            path = RIG.parent / file
            path.parent.mkdir(exist_ok=True)
            if path.suffix == ".npz":
                save_npz(path, matrix)
            else:
                mmwrite(path, matrix.tocoo(), comment=f"{RIG.stem}: {path.stem}", symmetry="symmetric")
        write_nodes(RIG.parent / part["nodes"], kept)
    write_table(
        RIG.parent / rig["joint"][0]["pairs"],
        ("node_a", "node_b", "area_m2", "nx", "ny", "nz"),
        ((plate.number(p), stiffener.number(p), f"{area:.12g}", 0, 0, 1) for p, area in contact()),
    )


def print_plate(plate: Part) -> None:
    """The bare plate beside a thin one, and with elements of half the size."""
    print("bare plate, Hz: these elements, elements of half their size, Kirchhoff")
    fine = solid((0.0, 0.0, -PLATE[2]), PLATE, ELEMENT / 2)
    for row in zip(
        natural_frequencies(plate.M, plate.K, 8), natural_frequencies(fine.M, fine.K, 8), thin_plate(8), strict=True
    ):
        print("".join(f"{value:10.3f}" for value in row), f"{100 * (row[0] / row[2] - 1):8.2f} %")


def print_rig(rig: dict[str, Any], plate: Kept, stiffener: Kept) -> None:
    """The whole rig's natural frequencies, from both parts before their reduction."""
    parts = {"plate": (plate, 0), "stiffener": (stiffener, plate.part.M.shape[0])}
    M = csc_array(block_diag([plate.part.M, stiffener.part.M]))
    K = csc_array(block_diag([plate.part.K, stiffener.part.K]))
    sensors = np.zeros(M.shape[0])
    for sensor in rig["sensor"]:
        kept, first = parts[sensor["part"]]
        rows = kept.part.rows(kept.places[sensor["at"] - 1])
        sensors[[first + row for row in rows]] += sensor["mass"]
    M = csc_array(M + coo_array((sensors, (np.arange(len(sensors)),) * 2)))
    joint = rig["joint"][0]
    for name, moduli in joint["preload"].items():
        for factor in (1.0, 0.5, 2.0):
            E, G = (factor * moduli[key] for key in ("normal_modulus", "shear_modulus"))
            held = joint_stiffness(plate.part, stiffener.part, E, G, joint["layer_height"])
            found = natural_frequencies(M, csc_array(K + held), 12)
            print(f"rig at {name}, moduli x {factor:g}, Hz:", ", ".join(f"{f:.3f}" for f in found))


def main() -> None:
    """Write the files beside the rig file, then print natural frequencies."""
    rig = tomllib.loads(RIG.read_text())
    whole = solid((0.0, 0.0, -PLATE[2]), PLATE), solid(STIFFENER_AT, STIFFENER)
    kept = kept_nodes(*whole)
    write_files(rig, *kept)
    print_plate(whole[0])
    print_rig(rig, *kept)


if __name__ == "__main__":
    main()
