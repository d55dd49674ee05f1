"""A rig updated to a modal table with shapes, made from another mesh of a softer beam."""

import numpy as np
import pytest

from recordings.errors import InputError
from recordings.responses import FoundModes, Responses
from twin.identify.responses.modal_tables import update_to_modes
from twin.rigs import Place
from twin.structure import assemble, normal_modes

AT = (0.1, 0.25, 0.4, 0.55, 0.7)


def modal_table(rig, kept=(0, 1, 2, 3), *, nodes=True):
    structure = assemble(rig)
    modes = normal_modes(structure.M, structure.stiffness([], []), 8)
    rows = np.array([structure.row(Place("beam", at, (0.0, 1.0, 0.0))) for at in AT])
    shapes = rows @ modes.Phi
    found = [
        FoundModes(
            frequency_Hz=float(modes.omega[k] / (2 * np.pi)),
            damping_ratio=0.01 * (k + 1),
            nodes=np.arange(1, len(AT) + 1),
            shape=np.outer(shapes[:, k], [0.0, 3.0, 0.0]) + 0j,
        )
        for k in kept
    ]
    where = {n: (at, 0.0, 0.0) for n, at in enumerate(AT, 1)} if nodes else {}
    return Responses(path="modes.unv", responses=(), modes=tuple(found), nodes=where)


def test_modes_are_paired_and_the_modulus_is_updated(lab):
    found = update_to_modes(modal_table(lab.with_modulus(lab.rig, 0.9, elements=42)), lab.rig)
    modulus = next(one for one in found.values if one.name == "youngs_modulus beam")
    assert modulus.after.value / modulus.before.value == pytest.approx(
        0.9, abs=3 * modulus.after.std / modulus.before.value
    )
    assert [pair.mode for pair in found.pairs] == [1, 2, 3, 4]
    assert all(pair.mac_after > 0.999 for pair in found.pairs)
    assert all(abs(pair.after_Hz / pair.measured_Hz - 1) < 0.003 for pair in found.pairs)
    assert found.rig.damping.modal_ratio[:4] == pytest.approx([0.01, 0.02, 0.03, 0.04])


def test_a_mode_that_was_missed_shifts_no_other(lab):
    found = update_to_modes(modal_table(lab.with_modulus(lab.rig, 0.97), kept=(0, 2, 3)), lab.rig)
    assert [pair.mode for pair in found.pairs] == [1, 3, 4]
    assert found.rig.natural_frequencies.offset[1] == 0.0
    assert found.rig.damping.modal_ratio[1] == pytest.approx(0.004)


def test_without_nodes_there_is_no_mac(lab):
    found = update_to_modes(modal_table(lab.rig, nodes=False), lab.rig)
    assert [pair.mac_after for pair in found.pairs] == [None] * 4
    assert any("by frequency alone" in note for note in found.notes)


def test_modes_of_something_else_are_one_line(lab):
    table = modal_table(lab.rig)
    far = [FoundModes(**{**vars(mode), "frequency_Hz": 5e4 + n}) for n, mode in enumerate(table.modes)]
    with pytest.raises(InputError, match="none of its modes"):
        update_to_modes(Responses(path="modes.unv", responses=(), modes=tuple(far)), lab.rig)
