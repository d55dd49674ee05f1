"""Measured modes beside a rig's: frequency pairs, modal assurance criteria, and places at nodes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.modes.pairing import paired
from twin.identify.modes.shapes import mac_matrix
from twin.rigs import Place
from twin.structure.modelled_rig import ModelledRig
from twin.structure.modes import are_counted
from twin.structure.plausibility import largest_motion


@dataclass(frozen=True, kw_only=True, eq=False)
class BesideModel:
    """Measured modes r and the model's m."""

    modelled: ModelledRig
    places: tuple[Place, ...]
    """Of the shapes' rows d."""
    shapes: Array
    """The model's, (d, m)."""
    mac: Array
    """Ones where a shape is a single number, (r, m)."""
    pairs: Mapping[int, int]
    """Number of the model's mode by that of the measured one, both from 0."""

    @property
    def numbers(self) -> dict[int, int]:
        """In a table of frequencies, by the measured mode from 0; none of a mode that these do not count."""
        modes, structure = self.modelled.modes, self.modelled.structure
        counted = are_counted(structure.M, modes.Phi[:, : self.shapes.shape[1]], structure.counted)
        return {r: int(counted[: m + 1].sum()) for r, m in sorted(self.pairs.items()) if counted[m]}

    def scaled(self, measured: Array, mode: int) -> Array:
        """A measured shape (d,) as large as the model's mode, by least squares."""
        model = self.shapes[:, mode]
        return np.asarray(measured * (np.vdot(measured, model) / np.vdot(measured, measured).real))


def beside_model(
    modelled: ModelledRig, places: Sequence[Place], measured_Hz: Array, measured: Array, *, highest_Hz: float
) -> BesideModel:
    """Pair measured modes, shapes (d, r), with those of a model up to a third above a frequency."""
    count = max(1, int(np.searchsorted(modelled.modes.frequency_Hz, 4 / 3 * highest_Hz)))
    shapes = np.array([modelled.structure.row(place) for place in places]) @ modelled.modes.Phi[:, :count]
    mac = mac_matrix(measured, shapes) if len(places) > 1 else np.ones((measured.shape[1], count))
    pairs = paired(measured_Hz, modelled.modes.frequency_Hz[:count], mac)
    return BesideModel(modelled=modelled, places=tuple(places), shapes=shapes, mac=mac, pairs=pairs)


def missing_and_still(
    beside: BesideModel, band_Hz: tuple[float, float], references: Mapping[str, Place], names: Sequence[str]
) -> Iterator[str]:
    """What of the model's modes in a band was not found, and which places hardly show one of them.

    Parameters
    ----------
    references
        Where every mode must move to be seen: sensors, or what is hit, that stay where they are.
    names
        Of the places of the shapes.
    """
    m = beside.modelled
    Hz = m.modes.frequency_Hz[: beside.shapes.shape[1]]
    inside = np.flatnonzero((Hz > band_Hz[0]) & (Hz < band_Hz[1]))
    missed = set(inside.tolist()) - set(beside.pairs.values())
    largest = largest_motion(m, len(Hz))
    explained: set[int] = set()
    shown = np.abs(beside.shapes) / largest
    best = int(np.argmax(np.min(shown[:, inside], axis=1))) if len(inside) else 0
    for name, place in references.items():
        if place.reads == "strain":
            continue
        share = np.abs(m.structure.row(place) @ m.modes.Phi[:, : len(Hz)]) / largest
        for mode in (k for k in inside.tolist() if share[k] < LIMITS.at_a_node):
            explained |= {mode} & missed
            yield (
                f"{name} is at a node of mode {mode + 1} ({Hz[mode]:.5g} Hz), with {share[mode]:.1%} of its largest "
                f"motion{': that mode was not found' if mode in missed else ''}; place {names[best]} has "
                f"{np.min(shown[best, inside]):.0%} at least in every mode of the band"
            )
    alike = np.triu(mac_matrix(beside.shapes, beside.shapes), 1) if len(beside.places) > 1 else np.zeros((1, 1))
    for one, other in np.argwhere(alike > LIMITS.hardly_told_apart):
        yield (
            f"modes {one + 1} and {other + 1} of the model look alike at these places, MAC {alike[one, other]:.2f}: "
            "more places, or another direction, would tell them apart"
        )
    for mode in sorted(missed - explained):
        yield f"mode {mode + 1} of the model, {Hz[mode]:.5g} Hz, was not found"
