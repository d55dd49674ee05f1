"""What the shaker holds at the drive point, against the bench's own shaker."""

import numpy as np
import pytest

from twin.bench import BenchSetup, open_bench
from twin.identify.forward.shaker_impedance import drive_stiffness
from twin.identify.linear.linear_model import Output, build_linear_model, nominal_parameters
from twin.identify.linear.structural_modification import update_receptance
from twin.rigs import load_rig
from twin.structure import layer_points

RIG = load_rig("steel-lap-joint")
FREQUENCY_Hz = np.array([5.0, 25.0, 26.4, 79.2, 156.0, 468.0, 600.0])
OMEGA = 2 * np.pi * FREQUENCY_Hz


def driven(**changes):
    """The steel rig with another shaker."""
    return RIG.model_copy(update={"drive": RIG.drive.model_copy(update=changes)})


SHAKERS = [{}, {"amplifier": "current"}, {"stinger_stiffness": 2e4, "coil_inductance": 2e-3}]


@pytest.mark.parametrize("changes", SHAKERS, ids=["voltage", "current", "soft-stinger"])
def test_a_silent_shaker_is_a_spring_at_the_drive_point(changes):
    """The layer's openings as they push each other, on the bench's linear rig in states: shaker, amplifier and coil."""
    rig, by = driven(**changes), {}
    for drive in ("shaker", "force"):
        bench = open_bench(rig, setup=BenchSetup(drive=drive, layout=rig.layout()))
        by[drive] = -bench.built.rig(0.0, 51200.0).transfer(FREQUENCY_Hz)[:, :3, 1:4]
    expected = by["shaker"] - by["force"]
    model = build_linear_model(rig, [Output("acc2", "acceleration", rig.place_of("acc2"))])
    at, points = len(model.ports.outer), layer_points(model.structure, 3)
    free = model.with_points(points.opening).receptance(OMEGA, nominal_parameters(rig), inner=False)
    held = update_receptance(free, np.array([model.ports.drive]), drive_stiffness(rig.drive, OMEGA)[:, None])
    size = np.max(np.abs(expected), axis=(1, 2), keepdims=True)
    np.testing.assert_allclose((held - free)[:, at:, at:] / size, expected / size, atol=1e-2)


def test_an_amplifier_that_holds_the_current_takes_the_damping_of_the_coil_away():
    holds_voltage, holds_current = (drive_stiffness(driven(amplifier=a).drive, OMEGA) for a in ("voltage", "current"))
    assert np.all(holds_voltage.imag > 100 * holds_current.imag)
    assert np.all(holds_current.imag > 0)
