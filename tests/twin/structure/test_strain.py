"""The strain of a beam's surface: static and in mode 1, against the analytic cantilever."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest

from recordings import InputError, quantities
from recordings.quantities import Quantity
from recordings.streams import Excitation
from twin.bench import BenchSetup, open_bench
from twin.rigs import Place, parse_rig
from twin.structure import assemble, normal_modes

LENGTH, WIDTH, THICKNESS, E, DENSITY = 0.4, 0.03, 0.008, 70e9, 2700.0
AREA, SECOND_MOMENT = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
BETA_L = 1.8751040687
TURN = radians(30.0)


def cantilever(*, shear_ratio=0.0, turned=0.0, gauges=(0.1,), direction=None, measured="strain"):
    axis, normal = [cos(turned), sin(turned)], [-sin(turned), cos(turned)]
    end = [LENGTH * x for x in axis]
    text = f"""
format = 2
name = "cantilever"
support = [{{ part = "beam", at = 0.0, fix = ["x", "y", "rz"] }}]
damping = {{ modal_ratio = [0.01] }}
[[part]]
name = "beam"
kind = "beam"
start = [0.0, 0.0]
end = {end}
width = {WIDTH}
thickness = {THICKNESS}
youngs_modulus = {E}
density = {DENSITY}
shear_ratio = {shear_ratio}
elements = 20
[drive]
part = "beam"
at = {LENGTH}
direction = {normal}
armature_mass = 0.01
suspension_stiffness = 3000.0
force_factor = 5.0
coil_resistance = 1.5
coil_inductance = 2e-4
stinger_stiffness = 1e6
[[sensor]]
channel = "force"
quantity = "force"
part = "beam"
at = {LENGTH}
range = 50.0
[[sensor]]
channel = "tip"
quantity = "displacement"
part = "beam"
at = {LENGTH}
direction = {normal}
range = 0.1
"""
    for number, at in enumerate(gauges):
        text += f"""
[[sensor]]
channel = "gauge{number}"
quantity = "{measured}"
part = "beam"
at = {at}
direction = {direction or normal}
range = 2e-3
"""
    return parse_rig(text.encode(), source="cantilever.toml")


def mode_1(x):
    """Analytic deflection and curvature, in any scale."""
    b = BETA_L / LENGTH
    s = (np.cosh(BETA_L) + np.cos(BETA_L)) / (np.sinh(BETA_L) + np.sin(BETA_L))
    v = np.cosh(b * x) - np.cos(b * x) - s * (np.sinh(b * x) - np.sin(b * x))
    return v, b**2 * (np.cosh(b * x) + np.cos(b * x) - s * (np.sinh(b * x) + np.sin(b * x)))


@pytest.mark.parametrize("shear_ratio", [0.0, 3.0])
@pytest.mark.parametrize("turned", [0.0, TURN])
@pytest.mark.parametrize("at", [0.0, 0.013, 0.1, 0.33])
def test_static_strain_under_a_tip_force(shear_ratio, turned, at):
    rig = cantilever(shear_ratio=shear_ratio, turned=turned)
    structure = assemble(rig)
    place = rig.place_of("gauge0")
    left, right = (Place("beam", at, tuple(side * x for x in place.direction), reads="strain") for side in (1, -1))
    along = (cos(turned), sin(turned), 0.0)
    across, axial = (
        np.linalg.solve(structure.K0, structure.row(Place("beam", LENGTH, direction)))
        for direction in (place.direction, along)
    )
    bent = THICKNESS / 2 * (LENGTH - at) / (E * SECOND_MOMENT)
    # The left surface is shortened by a force towards it.
    assert structure.row(left) @ across == pytest.approx(-bent, rel=1e-6)
    assert structure.row(right) @ across == pytest.approx(bent, rel=1e-6)
    for surface in (left, right):
        assert structure.row(surface) @ axial == pytest.approx(1 / (E * AREA), rel=1e-6)


@pytest.mark.parametrize("at", [0.0, 0.1, 0.2])
def test_strain_in_mode_1(at):
    structure = assemble(cantilever())
    shape = normal_modes(structure.M, structure.K0, 1).Phi[:, 0]
    gauge = Place("beam", at, (0.0, 1.0, 0.0), reads="strain")
    tip = structure.row(Place("beam", LENGTH, (0.0, 1.0, 0.0))) @ shape
    expected = -THICKNESS / 2 * mode_1(at)[1] / mode_1(LENGTH)[0]
    assert structure.row(gauge) @ shape / tip == pytest.approx(expected, rel=2e-3)


def marched(rig, frequency_Hz, *, wait_s, seconds):
    bench = open_bench(rig, sample_rate_Hz=2048.0, setup=BenchSetup(drive="force", noise=False, converter=False))
    bench.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=frequency_Hz))
    bench.read(int(wait_s * 2048))
    samples = bench.read(int(seconds * 2048)).samples
    t = np.arange(int(seconds * 2048)) / 2048
    wave = np.exp(-2j * np.pi * frequency_Hz * t)
    return bench, {name: 2 * np.mean(values * wave) for name, values in samples.items()}


def test_the_bench_shows_it_quasi_statically_and_in_mode_1():
    rig = cantilever(gauges=(0.0, 0.1))
    bench, slow = marched(rig, 1.0, wait_s=4.0, seconds=2.0)
    assert [c.unit for c in bench.channels] == ["N", "m", "m/m", "m/m"]
    for name, at in (("gauge0", 0.0), ("gauge1", 0.1)):
        bent = -THICKNESS / 2 * (LENGTH - at) / (E * SECOND_MOMENT)
        assert slow[name] / slow["force"] == pytest.approx(bent, rel=3e-3)
    first_Hz = normal_modes(assemble(rig).M, assemble(rig).K0, 1).omega[0] / (2 * np.pi)
    _, resonant = marched(rig, round(first_Hz), wait_s=3.0, seconds=1.0)
    for name, at in (("gauge0", 0.0), ("gauge1", 0.1)):
        expected = -THICKNESS / 2 * mode_1(at)[1] / mode_1(LENGTH)[0]
        found = resonant[name] / resonant["tip"]
        # the other modes have one or two per cent of the strain at the clamp
        assert found.real == pytest.approx(expected, rel=0.02)
        assert abs(found.imag) < 0.02 * abs(expected)


def test_a_quantity_from_outside_is_marched_by_its_row_of_the_table(monkeypatch):
    rate = Quantity(name="strain-rate", unit="1/s", code=130, reads="strain", derivative=1)
    known = {**quantities.known_quantities(), rate.name: rate}
    monkeypatch.setattr(quantities, "known_quantities", lambda: known)
    _, strain = marched(cantilever(), 3.0, wait_s=3.0, seconds=1.0)
    bench, found = marched(cantilever(measured="strain-rate"), 3.0, wait_s=3.0, seconds=1.0)
    assert bench.channels[2].unit == "1/s"
    # A rate is that of the modes that are kept; without a shaker, what the others have of it is missing.
    assert found["gauge0"] / strain["gauge0"] == pytest.approx(2j * np.pi * 3.0, rel=1e-2)


def test_a_gauge_is_on_a_surface_of_a_beam():
    with pytest.raises(InputError, match="direction must be across 'beam'"):
        cantilever(direction=[1.0, 0.0])
    with pytest.raises(InputError, match="measures one of force, acceleration, velocity, displacement, strain"):
        cantilever(measured="pressure")
    with pytest.raises(InputError, match="measures one of"):
        cantilever(measured="temperature")
