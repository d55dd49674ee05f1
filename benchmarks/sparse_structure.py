"""The lap joint on fine meshes, and the same put together by hand of sparse matrices."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import eigsh, splu

from twin.bench import BenchSetup, open_bench
from twin.rigs import BeamPart, Layout, Rig, load_rig, moduli_at
from twin.structure.elements.beam import beam_mass, beam_stiffness, deflection_shape
from twin.structure.elements.thin_layer import thin_layer

Array = NDArray[np.float64]

LAYER, MODES, COMPARED = 20, 30, 8
"""Elements of the layer; modes of the reduction; natural frequencies that are compared."""
RATE_Hz = 51200.0
MOST_LOADS = 64


def long_rig(elements: int) -> tuple[Rig, Layout]:
    """The steel rig with sensors that weigh nothing, and its layout in so many beam elements."""
    rig = load_rig("steel-lap-joint")
    sensors = [sensor.model_copy(update={"mass": 0.0}) for sensor in rig.sensor]
    rig = rig.model_copy(update={"sensor": sensors})
    return rig, rig.layout(beam_elements=elements, layer_elements=LAYER)


def ready(rig: Rig, layout: Layout) -> Array:
    """Natural frequencies (rad/s) of a bench that is ready to march: assembled, reduced, its poles found."""
    bench = open_bench(rig, sample_rate_Hz=RATE_Hz, setup=BenchSetup(layout=layout, drive="force"))
    return bench.built.modal(0.0, RATE_Hz).omega[:COMPARED]


def structure_by_hand(rig: Rig, layout: Layout) -> Array:
    """The same: two chains of beam elements and a layer, factors for as many static shapes, modes by Lanczos."""
    M, K = [], []
    first: dict[str, int] = {}
    size = 0
    (layer,), (moduli,) = layout.joints, moduli_at(rig)
    assert layer.begin is not None
    assert layer.to is not None
    stations = {part.name: _stations(part, layer.begin, layer.to) for part in layout.beams}
    for part in layout.beams:
        s, first[part.name] = stations[part.name], size
        section = {"EA": part.youngs_modulus * part.area, "EI": part.youngs_modulus * part.second_moment}
        length = np.diff(s)
        dofs = size + 3 * np.arange(len(length))[:, None] + np.arange(6)
        K.append((dofs, beam_stiffness(**section, length=length)))
        M.append((dofs, beam_mass(mass_per_length=part.density * part.area, length=length)))
        size += 3 * len(s)
    lower, upper = layout.beams
    on_lower, on_upper = (_overlapping(stations[part.name], part, layer.begin, layer.to) for part in layout.beams)
    for a, b in zip(on_lower[:-1], on_upper[:-1], strict=True):
        element = thin_layer(
            length=stations[lower.name][a + 1] - stations[lower.name][a], height=layer.layer_height,
            width=layer.width or lower.width, bottom_thickness=lower.thickness, top_thickness=upper.thickness,
        )  # fmt: skip
        B_E, B_G = element.normal.B, element.shear.B
        own = moduli.normal_modulus * B_E.T @ B_E + moduli.shear_modulus * B_G.T @ B_G
        dofs = np.concatenate([first[lower.name] + 3 * a + np.arange(6), first[upper.name] + 3 * b + np.arange(6)])
        K.append((dofs[None], own[None]))
    K_all, M_all = (_summed(parts, size)[3:, 3:] for parts in (K, M))  # clamped at the lower beam's first node
    factors = splu(K_all)
    places = np.linspace(0.1, upper.length * 0.9, MOST_LOADS)
    factors.solve(np.column_stack([_load(x, stations[upper.name], first[upper.name], size)[3:] for x in places]))
    values = eigsh(K_all, MODES, M_all, sigma=0.0, v0=np.ones(size - 3), return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(values)[:COMPARED]))


def _stations(part: BeamPart, begin: float, to: float) -> Array:
    """Nodes along a beam: so many over the layer, the others evenly over the rest."""
    at = float(part.start[0])
    inside = np.linspace(begin, to, LAYER + 1) - at
    rest = part.elements - LAYER
    if inside[0] > 1e-9:
        return np.concatenate([np.linspace(0.0, inside[0], rest + 1)[:-1], inside])
    return np.concatenate([inside, np.linspace(inside[-1], part.length, rest + 1)[1:]])


def _overlapping(s: Array, part: BeamPart, begin: float, to: float) -> NDArray[np.int64]:
    x = s + float(part.start[0])
    return np.flatnonzero((x > begin - 1e-9) & (x < to + 1e-9))


def _summed(parts: list[tuple[NDArray[np.int64], Array]], size: int) -> csc_array:
    rows = np.concatenate([np.repeat(dofs, dofs.shape[1], axis=1).ravel() for dofs, _ in parts])
    columns = np.concatenate([np.tile(dofs, (1, dofs.shape[1])).ravel() for dofs, _ in parts])
    return csc_array((np.concatenate([values.ravel() for _, values in parts]), (rows, columns)), shape=(size, size))


def _load(x: float, s: Array, first: int, size: int) -> Array:
    e = min(int(np.searchsorted(s, x, side="right")) - 1, len(s) - 2)
    length, row = s[e + 1] - s[e], np.zeros(size)
    row[first + 3 * e + np.array([1, 2, 4, 5])] = deflection_shape((x - s[e]) / length, length)
    return row
