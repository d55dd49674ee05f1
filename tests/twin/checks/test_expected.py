"""The expected response, column by column, is that of the full matrix of receptances."""

from pathlib import Path

import numpy as np
import pytest
from small_rigs import rig_file

from twin.checks.expected import ExpectedResponse
from twin.identify.linear.linear_model import Output
from twin.rigs import load_rig, preload_names


@pytest.mark.parametrize("name", ["steel-lap-joint", "bars-in-space"])
def test_it_is_the_column_of_a_structure_with_its_dampers(tmp_path: Path, name: str) -> None:
    rig = load_rig(rig_file(name, tmp_path))
    outputs = [Output(s.channel, s.quantity, rig.place_of(s.channel), 1.0) for s in rig.response_sensors]
    model = ExpectedResponse.of(rig, outputs, next(iter(preload_names(rig))))
    ports, frequency_Hz = model.model.ports, np.linspace(3.0, 900.0, 57)
    assert len(ports.dampers) == (name == "bars-in-space")
    rows, omega = (
        np.vstack([ports.rows[ports.drive], ports.rows[ports.outputs], ports.dampers]),
        2 * np.pi * frequency_Hz,
    )
    R = model.model.basis.receptance(rows, omega)
    viscous = np.zeros((len(rows), len(rows)))
    viscous[len(outputs) + 1 :, len(outputs) + 1 :] = np.eye(len(ports.dampers))
    attached = np.linalg.solve(np.eye(len(rows)) + R @ (1j * omega[:, None, None] * viscous), R)
    expected = attached[:, 1 : len(outputs) + 1, 0] * model.model.to_quantity(omega)
    np.testing.assert_allclose(model.H(frequency_Hz), expected, rtol=1e-9)
