"""Models of a changed structure: kept while nothing of the structure moves, built anew as soon as anything does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection

from twin.identify.linear.changed_model import ChangedModels
from twin.identify.linear.linear_model import build_linear_model
from twin.identify.model_modification import Attachment, ModelModification
from twin.rigs import load_rig, preload_name

RIG = load_rig("steel-lap-joint")
SOFTER = ModelModification(beam_modulus={"upper": 0.9})


@pytest.fixture
def models():
    return ChangedModels(RIG, preload_name(RIG))


def test_what_leaves_the_structure_alone_builds_nothing(models, steel_model):
    mass = Attachment(lambda s: deflection(s, 0.3)[None], lambda omega: -0.01 * omega[:, None] ** 2)
    kept = models.model(SOFTER, steel_model.outputs)
    assert models.model(replace(SOFTER, attachments=(mass,), frequency_factor=1.01), steel_model.outputs) is kept


@pytest.mark.parametrize(
    "change",
    [
        {"beam_modulus": {"upper": 0.9 + 1e-9}},
        {"beam_modulus": {"lower": 0.9}},
        {"beam_shear_ratio": {"upper": 30.0}},
        {"clamp_rad_per_Nm": {"lower": 1e-5}},
        {"layer_gradient": {"joint": 0.5}},
        {"drive_offset_m": {"drive": 0.01}},
        {"output_offset_m": {"acc2": -0.01}},
    ],
)
def test_whatever_moves_is_built_anew(models, steel_model, change):
    kept = models.model(SOFTER, steel_model.outputs)
    anew = models.model(replace(SOFTER, **change), steel_model.outputs)
    assert anew is not kept
    assert not np.array_equal(anew.ports.rows @ anew.basis.Phi, kept.ports.rows @ kept.basis.Phi)


def test_a_rig_file_with_that_modulus_is_the_same_model(models, steel_model):
    upper = RIG.upper.model_copy(update={"youngs_modulus": 0.9 * RIG.upper.youngs_modulus})
    rig = RIG.model_copy(update={"upper": upper})
    own = build_linear_model(rig, list(steel_model.outputs))
    np.testing.assert_allclose(models.model(SOFTER, steel_model.outputs).basis.omega, own.basis.omega, rtol=1e-12)
