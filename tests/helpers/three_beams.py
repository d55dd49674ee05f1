"""Three bolted beams in plain numpy, assembled in primal form on meshes that no rig file has."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from circular_noise import circular
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

YOUNG, DENSITY, WIDTH, THICKNESS, RATIO = 70e9, 2700.0, 0.03, 0.008, 0.005
LENGTHS, ELEMENTS = (0.30, 0.32, 0.28), (41, 47, 43)
BOLTS = ((0.255, 0.015), (0.285, 0.045), (0.275, 0.015), (0.305, 0.045))
"""Where each bolt sits on the two beams that it joins: two between the first and the second, two behind."""
POINTS = (0.015, 0.045, 0.275, 0.305)
DRIVE, SENSORS = 0.12, (("root", 0, 0.18), ("tip", 2, 0.26))
STIFFNESS, LOSS = (2e6, 1.5e6, 3e6, 1e6), 0.02
LINES_HZ = np.arange(5.0, 1000.5, 1.0)
"""Every response of the second beam, and of the whole."""


class Beam:
    """A plane Euler-Bernoulli beam in bending, with modal damping."""

    def __init__(self, length: float, elements: int, *, clamped: bool) -> None:
        self.h, size = length / elements, 2 * elements + 2
        h, EI, m = self.h, YOUNG * WIDTH * THICKNESS**3 / 12, DENSITY * WIDTH * THICKNESS
        stiff = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                 [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]  # fmt: skip
        heavy = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                 [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]  # fmt: skip
        M, K = np.zeros((size, size)), np.zeros((size, size))
        for e in range(elements):
            own = slice(2 * e, 2 * e + 4)
            K[own, own] += EI / h**3 * np.array(stiff)
            M[own, own] += m * h / 420 * np.array(heavy)
        self.held = 2 if clamped else 0
        self.M, self.K = M[self.held :, self.held :], K[self.held :, self.held :]
        square, Phi = eigh(self.K, self.M)
        shaped = self.M @ Phi * np.sqrt(2 * RATIO * np.sqrt(np.maximum(square, 0.0)))
        self.C = shaped @ shaped.T

    def rows(self, places: Array) -> Array:
        found = np.zeros((len(places), len(self.M) + self.held))
        for row, s in zip(found, places, strict=True):
            e = min(int(s / self.h + 1e-9), len(row) // 2 - 2)
            x, h = s / self.h - e, self.h
            row[2 * e : 2 * e + 4] = (
                1 - 3 * x**2 + 2 * x**3, h * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, h * (x**3 - x**2),
            )  # fmt: skip
        return found[:, self.held :]


def accelerance(M: Array, C: Array, K: Complex, rows: Array, loads: Array) -> Complex:
    """(f, o, i) at the lines."""
    omega = 2 * np.pi * LINES_HZ
    return np.array([-(w**2) * rows @ np.linalg.solve(K + 1j * w * C - w**2 * M, loads.T) for w in omega])


BEAMS = tuple(Beam(*both, clamped=number == 0) for number, both in enumerate(zip(LENGTHS, ELEMENTS, strict=True)))


@cache
def measured_part() -> Complex:
    """Accelerances of the second beam by itself, hung free."""
    beam = BEAMS[1]
    return accelerance(beam.M, beam.C, beam.K + 0j, *[beam.rows(np.array(POINTS))] * 2)


@cache
def whole() -> Complex:
    """Accelerances of the sensors over the drive's force, all three beams assembled, (f, o)."""
    M, C, K = (block_diag(*(getattr(beam, name) for beam in BEAMS)) for name in "MCK")
    sizes = np.cumsum([0, *(len(beam.M) for beam in BEAMS)])

    def row(beam: int, place: float) -> Array:
        found = np.zeros(len(M))
        found[sizes[beam] : sizes[beam + 1]] = BEAMS[beam].rows(np.array([place]))[0]
        return found

    K = K.astype(complex)
    for number, (k, places) in enumerate(zip(STIFFNESS, BOLTS, strict=True)):
        first = number // 2
        gap = row(first + 1, places[1]) - row(first, places[0])
        K += k * (1 + 1j * LOSS) * np.outer(gap, gap)
    rows = np.array([row(beam, place) for _, beam, place in SENSORS])
    return accelerance(M, C, K, rows, row(0, DRIVE)[None])[:, :, 0]


def noisy(H: Complex, rng: np.random.Generator, size: float = 1e-3) -> Complex:
    return H * (1 + circular(rng, size, H.shape))


def write(path: Path, H: Complex, channels: list[str], references: list[str]) -> None:
    """Accelerances (f, o, i) as an archive."""
    np.savez(
        path, frequency_Hz=LINES_HZ, frf=np.moveaxis(H, 0, 2), channels=channels, references=references,
        frf_form="accelerance",
    )  # fmt: skip


def rig_text(factors: tuple[float, ...] = (1.0,) * 4, *, loss: float = LOSS) -> str:
    """The rig file: the first and the third beam by models of their own mesh, the second by its responses."""
    beam = f'kind = "beam"\nwidth = {WIDTH}\nthickness = {THICKNESS}\nyoungs_modulus = {YOUNG}\ndensity = {DENSITY}\n'
    text = f"""format = 2
kind = "substructures"
name = "three-beams"

[[part]]
name = "a"
{beam}start = [0.0, 0.0]
end = [{LENGTHS[0]}, 0.0]
elements = 30

[[part]]
name = "c"
{beam}start = [0.54, 0.0]
end = [{0.54 + LENGTHS[2]}, 0.0]
elements = 28

[[measured_part]]
name = "b"
responses = "b.npz"

[[support]]
part = "a"
at = 0.0
fix = ["x", "y", "rz"]

[damping]
modal_ratio = [{RATIO}]

[drive]
part = "a"
at = {DRIVE}

[[sensor]]
channel = "force"
quantity = "force"
part = "a"
at = {DRIVE}
range = 50.0
"""
    for channel, part, at in SENSORS:
        text += f'\n[[sensor]]\nchannel = "{channel}"\nquantity = "acceleration"\npart = "{"abc"[part]}"\nat = {at}\n'
        text += "range = 490.0\n"
    for n, (k, (one, other), factor) in enumerate(zip(STIFFNESS, BOLTS, factors, strict=True)):
        ends = f'["a", "b"]\nat = [{one}, "b{n + 1}"]' if n < 2 else f'["b", "c"]\nat = ["b{n + 1}", {other}]'
        text += f'\n[[connection]]\nname = "bolt-{n + 1}"\nbetween = {ends}\n'
        text += f"stiffness = {{ y = {k * factor} }}\nloss_factor = {loss}\n"
    return text


def files(folder: Path, rng: np.random.Generator, size: float = 1e-3) -> Path:
    """Rig file, b.npz and coupled.npz in a folder, the responses with noise of this relative size; the rig's path."""
    names = [f"b{n + 1}" for n in range(len(POINTS))]
    write(folder / "b.npz", noisy(measured_part(), rng, size), names, names)
    write(folder / "coupled.npz", noisy(whole(), rng, size)[:, :, None], [name for name, *_ in SENSORS], ["force"])
    (folder / "rig.toml").write_text(rig_text())
    return folder / "rig.toml"


def away_from_antiresonances(H: Complex) -> NDArray[np.bool_]:
    """Lines of responses (f, o) above a tenth of the geometric mean of those around."""
    level = np.log(np.abs(H))
    window = np.ones(101) / 101
    around = np.array([np.convolve(np.pad(one, 50, mode="edge"), window, "valid") for one in level.T]).T
    return np.asarray(level > around + np.log(0.1))
