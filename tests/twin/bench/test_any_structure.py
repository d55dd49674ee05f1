"""The bench of rigs that are no clamped lap joint: against all their coordinates at once; what is hidden in them."""

from dataclasses import replace

import numpy as np
import pytest

from recordings import InputError, Run
from recordings.directions import cosine, unit_vector
from twin.bench import BenchSetup, no_law, open_bench
from twin.bench.limits import LIMITS
from twin.identify.measured_data import response_outputs
from twin.rigs import Effect, Place, load_rig, moduli_at, with_moduli
from twin.structure import assemble, normal_modes, rigid_motions, with_mass_at

RIGS = ("hung-lap-joint", "l-frame", "two-lap-joints", "shaking-base", "stiffened-plate")
FREQUENCIES_Hz = np.array([8.0, 31.0, 77.0, 160.0, 210.0, 420.0, 640.0])


def dense_responses(rig, omega):
    """Displacements of all response sensors per force, by a solve at each frequency with modal damping."""
    s = assemble(rig, layout=rig.bench_layout())
    moduli = moduli_at(rig)
    K = s.stiffness([m.normal_modulus for m in moduli], [m.shear_modulus for m in moduli])
    modes = normal_modes(s.M, K)
    rigid, ratios = rigid_motions(modes.omega), rig.damping.modal_ratio
    zeta = np.array([0.0] * rigid + [ratios[min(n, len(ratios) - 1)] for n in range(len(modes.omega) - rigid)])
    shapes = s.M @ modes.Phi
    C = shapes @ np.diag(2 * zeta * modes.omega) @ shapes.T
    rows = np.array([s.row(rig.place_of(sensor.channel)) for sensor in rig.response_sensors])
    drive = s.row(rig.drive_place)
    return np.array([rows @ np.linalg.solve(K + 1j * w * C - w**2 * s.M, drive) for w in omega])


@pytest.mark.parametrize("name", RIGS)
def test_a_rigs_linear_response_is_that_of_all_its_coordinates(name):
    rig = load_rig(name)
    built = open_bench(rig, joint_law=no_law(), setup=BenchSetup(drive="force")).built
    assert built.rigid == {"hung-lap-joint": 3, "stiffened-plate": 6}.get(name, 0)
    channels = [sensor.channel for sensor in rig.sensor]
    outputs = [built.locals + built.auxiliaries + channels.index(s.channel) for s in rig.response_sensors]
    omega = 2 * np.pi * FREQUENCIES_Hz
    found = built.rig(0.0, 51200.0).transfer(FREQUENCIES_Hz)[:, outputs, 0] / -(omega[:, None] ** 2)
    expected = dense_responses(rig, omega)
    # An acceleration does not feel the flexibility above the bench's modes, and free rigs hang on cords.
    near = 5e-3 + (LIMITS.build_suspension_Hz / FREQUENCIES_Hz[:, None]) ** 2
    assert np.all(np.abs(found - expected) < near * np.abs(expected).max(axis=1, keepdims=True))


def first_modes(rig, **options):
    return open_bench(rig, joint_law=no_law(), **options).built.modal(0.0, 51200.0).omega[:4]


def test_an_effect_acts_on_the_joint_that_it_names():
    rig = load_rig("two-lap-joints")
    plain = first_modes(rig)
    softer = {
        joint: first_modes(rig, effects=[Effect(cause="joint-stiffness", parameters={
            "joint": joint, "normal_factor": 0.5, "shear_factor": 0.5,
        })]) for joint in ("inner", "outer")
    }  # fmt: skip
    for joint, frequencies in softer.items():
        number = ("inner", "outer").index(joint)
        halved = [
            m.model_copy(update={"normal_modulus": m.normal_modulus / 2, "shear_modulus": m.shear_modulus / 2})
            if n == number else m for n, m in enumerate(moduli_at(rig))
        ]  # fmt: skip
        np.testing.assert_allclose(frequencies, first_modes(with_moduli(rig, "120N", halved)), rtol=1e-9)
        assert frequencies[0] < plain[0] * (1 - 1e-5)
    assert softer["inner"][0] < softer["outer"][0], "the root's joint carries more of mode 1"


@pytest.mark.parametrize(
    ("cause", "parameters", "told"),
    [
        ("joint-slap", {"gap_m": 1e-6, "stiffness_factor": 0.1}, "which joint: inner, outer"),
        ("joint-slap", {"gap_m": 1e-6, "stiffness_factor": 0.1, "joint": "third"}, "no joint 'third'"),
        ("added-mass", {"mass_kg": 0.01, "part": "nose", "position_m": 0.1}, "no part 'nose'"),
        ("added-mass", {"mass_kg": 0.01, "part": "end", "position_m": 0.2}, "is not on 'end'"),
        ("added-mass", {"mass_kg": 0.01}, "needs position_m"),
        ("beam-modulus", {"beam": "lower", "factor": 0.9}, "no beam 'lower'; the rig has root, middle, end"),
    ],
)
def test_a_place_or_joint_that_is_none_is_refused(cause, parameters, told):
    with pytest.raises(ValueError, match=told):
        open_bench(load_rig("two-lap-joints"), effects=[Effect(cause=cause, parameters=parameters)])


def test_a_mass_at_a_node_is_felt_in_every_direction():
    rig = load_rig("stiffened-plate")
    node = int(rig.place_of("acc1").at)
    heavier = open_bench(
        rig, joint_law=no_law(),
        effects=[Effect(cause="added-mass", parameters={"mass_kg": 0.05, "part": "plate", "node": node})],
    ).built  # fmt: skip
    s = with_mass_at(assemble(rig, layout=rig.bench_layout()), rig.place_of("acc1"), 0.05)
    moduli = moduli_at(rig)
    K = s.stiffness([m.normal_modulus for m in moduli], [m.shear_modulus for m in moduli])
    expected = normal_modes(s.M, K, 14).omega[6:]
    np.testing.assert_allclose(heavier.modal(0.0, 51200.0).omega[6:14], expected, rtol=1e-5)


def test_a_recording_says_which_way_a_sensor_faces():
    """Otherwise an identification takes what points along -x or -y for the opposite of what it is."""
    frame = load_rig("l-frame")

    def reversed_(table):
        return table.model_copy(update={"direction": [-x for x in table.place.direction]})

    turned = [s if s.quantity == "force" else reversed_(s) for s in frame.sensor]
    rig = frame.model_copy(update={"sensor": turned, "drive": [reversed_(drive) for drive in frame.drive]})
    for one in (frame, rig):
        channels = {channel.name: channel for channel in open_bench(one, setup=BenchSetup(drive="force")).channels}
        for name, channel in channels.items():
            assert cosine(channel.direction, one.place_of(name).direction) == pytest.approx(1.0)
        assert {channels[s.channel].direction[1] for s in one.response_sensors} == {"x", "y"}


@pytest.mark.parametrize(
    ("recorded", "faces", "against"),
    [
        ("+x", "+x", False), ("-x", "+x", True), ("0.6,0.8,0", (0.6, 0.8, 0.0), False), ("+y", (0.6, -0.8, 0.0), True),
        # recorded by programs that know +y and -y alone
        ("+y", "+x", False), ("-y", "+x", True), ("+y", "-z", True), ("-y", "-x", False),
    ],
)  # fmt: skip
def test_a_sensor_that_faces_the_other_way_is_told_by_the_two_directions(recorded, faces, against):
    assert Place("arm", 0.1, unit_vector(faces)).faces_against(recorded) == against


def test_a_sensor_across_what_the_rig_says_is_refused():
    rig = load_rig("l-frame")
    channels = {c.name: replace(c, direction="+z") for c in open_bench(rig, setup=BenchSetup(drive="force")).channels}
    run = Run(path="run.mcap", info={}, channels=channels, devices={}, steps=(), events=())
    with pytest.raises(
        InputError, match=r"run.mcap: channel acc\w*: it was recorded along \+z, and the rig has it along"
    ):
        response_outputs([run], rig)
