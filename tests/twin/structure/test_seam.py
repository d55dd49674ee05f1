"""The seam: only its own package knows what a structure is made of, and a new kind of rig needs no other change."""

import re
from pathlib import Path

import numpy as np
import pytest

import twin
from recordings import RunWriter, read_run
from twin.bench import open_bench
from twin.demo import broadband
from twin.diagnose import diagnose
from twin.identify.measured_data import gather_data
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import Effect, load_rig, moduli_at, preload_record, with_moduli

INSIDE = ("rigs", "structure", "papers")
"""Packages that may know of beams' nodes and of the lap joint's file; the papers are about lap joints."""
KNOWN_INSIDE = re.compile(
    r"rig\.(lower|upper|joint|mesh)\b|\.meshes\b|structure\.(free|basis)\b|free % 3|\bBeamMesh\b|\bMatrixCoordinates\b|"
    r"\bLapJointRig\b|node_dofs|element_dofs"
)
NAMED = {"lab/rig.py"}
"""Says of a rig file what it is, in words."""

BEAMS = {
    "base": ([0.0, 0.0], [0.3, 0.0]),
    "right": ([0.3, 0.0], [0.3, 0.2]),
    "left": ([0.0, 0.0], [0.0, 0.2]),
    "top-left": ([0.0, 0.2], [0.18, 0.2]),
    "top-right": ([0.3, 0.2], [0.13, 0.2]),
}
CORNERS = {("base", "right"): 0.3, ("base", "left"): 0.0, ("left", "top-left"): 0.2, ("right", "top-right"): 0.2}
"""Two beams, and where along the first they are tied; the second is held by its beginning."""
RING = """
format = 2
name = "ring"

{parts}
{ties}

[[support]]
part = "base"
at = 0.15
fix = ["x", "y", "rz"]

[[joint]]
name = "lap"
kind = "thin-layer"
between = ["top-left", "top-right"]
from = 0.13
to = 0.18
layer_height = 0.006
[joint.preload."120N"]
normal_modulus = 3.9e8
shear_modulus = 7.6e7

[damping]
modal_ratio = [0.003]

[drive]
part = "right"
at = 0.12
direction = "+x"
armature_mass = 0.02
suspension_stiffness = 3150.0
force_factor = 5.5
coil_resistance = 1.5
coil_inductance = 0.0002
stinger_stiffness = 1.0e6

[[sensor]]
channel = "force"
quantity = "force"
part = "right"
at = 0.12
range = 50.0
noise_density = 2e-4

[[sensor]]
channel = "side"
quantity = "acceleration"
part = "left"
at = 0.15
direction = "+x"
range = 490.0
noise_density = 5e-4

[[sensor]]
channel = "top"
quantity = "acceleration"
part = "top-left"
at = 0.09
direction = [0.6, 0.8]
range = 490.0
noise_density = 5e-4
"""
BEAM = """kind = "beam"
width = 0.0254
thickness = 0.006
youngs_modulus = 198e9
density = 7880.0
elements = 12"""


def test_no_module_outside_knows_how_a_structure_is_made():
    root = Path(twin.__file__).parent
    found = [
        f"{path.relative_to(root)}: {match.group()}"
        for path in sorted(root.rglob("*.py"))
        if path.relative_to(root).parts[0] not in INSIDE and str(path.relative_to(root)) not in NAMED
        for match in KNOWN_INSIDE.finditer(path.read_text(encoding="utf-8"))
    ]
    assert found == []


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    path = tmp_path_factory.mktemp("ring") / "ring.toml"
    parts = [f'[[part]]\nname = "{name}"\n{BEAM}\nstart = {begin}\nend = {end}' for name, (begin, end) in BEAMS.items()]
    ties = [f'[[tie]]\nbetween = ["{one}", "{other}"]\nat = [{at}, 0.0]' for (one, other), at in CORNERS.items()]
    path.write_text(RING.replace("{parts}", "\n".join(parts)).replace("{ties}", "\n".join(ties)))
    return load_rig(path)


def test_a_ring_of_beams_is_recorded_and_its_joint_identified(ring, tmp_path):
    """A rig of another kind, described in this file alone: noise through the shaker, and E', G' found from it."""
    (nominal,) = moduli_at(ring)
    true = nominal.model_copy(update={"normal_modulus": 1.06 * nominal.normal_modulus, "shear_modulus": 7.0e7})
    acquisition = DirectAcquisition(open_bench(with_moduli(ring, "120N", [true]), seed=5))
    path = tmp_path / "noise.mcap"
    info = {"source": "simulated", "rig": ring.name, "stored": "settled"} | preload_record("120N")
    with RunWriter(path, info=info, channels=acquisition.channels) as writer:
        assert run_procedure(broadband(), acquisition, writer).state == "done"
    evidence = gather_data([read_run(path)], ring)
    assert evidence.linear is not None
    std = np.sqrt(np.diag(evidence.linear.covariance))
    base = evidence.linear.base
    assert evidence.linear.chi2_per_dof < 2.0
    assert abs(np.log(base.E / true.normal_modulus)) < max(4 * std[0], 0.02)
    assert abs(np.log(base.G / true.shear_modulus)) < max(4 * std[1], 0.02)
    assert std[0] < 0.03
    assert std[1] < 0.03


@pytest.mark.slow
def test_a_mass_hidden_on_the_ring_is_found_on_its_beam(ring, tmp_path):
    hidden = {"part": "left", "position_m": 0.11, "mass_kg": 0.012}
    bench = open_bench(ring, seed=6, effects=[Effect(cause="added-mass", parameters=hidden)])
    acquisition = DirectAcquisition(bench)
    path = tmp_path / "noise.mcap"
    info = {"source": "simulated", "rig": ring.name, "stored": "settled"} | preload_record("120N")
    with RunWriter(path, info=info, channels=acquisition.channels) as writer:
        assert run_procedure(broadband(), acquisition, writer).state == "done"
    found = diagnose([read_run(path)], ring).to_dict()
    assert found["verdict"] == "explained"
    first = found["causes"][0]
    assert first["cause"] == "added-mass"
    assert first["parameters"]["part"] == "left"
    for name in ("position_m", "mass_kg"):
        estimate = first["parameters"][name]
        assert abs(estimate["value"] - hidden[name]) < max(3 * estimate["std"], 0.03 * hidden[name])
