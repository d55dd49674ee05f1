"""A beam that is driven at two places: a procedure chooses, a recording names, one model holds for the runs of both."""

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import deflection
from drawn_frames import CLAMP, SHAKER, beam, drawn, read

from recordings import InputError, read_run
from twin.bench import BenchSetup, no_law, open_bench
from twin.checks import first_look
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import fit_base
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.forward.predict import blank_data
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.rig_channels import drive_of, own_channels
from twin.procedures import Random, SteppedSine
from twin.rehearsal import NominalRig, open_twin, rehearse
from twin.rigs import Effect, load_rig, preload_name
from twin.structure import assemble, normal_modes

AT = {"root": 0.075, "end": 0.24}
CELLS = {"root": "force", "end": "force-end"}
DIRECTIONS = {"root": "+y", "end": "-y"}


@pytest.fixture(scope="module")
def rig():
    """Clamped, two accelerometers; one shaker drives up near the clamp, the other, a stiffer one, down near the end."""
    table = drawn([beam("bar", (0, 0), (0.3, 0))], [{"part": "bar", "at": 0.0, "fix": CLAMP}])
    places = {name: {"part": "bar", "at": at, "direction": DIRECTIONS[name]} for name, at in AT.items()}
    stiffer = {"root": {}, "end": {"suspension_stiffness": 9000.0}}
    table["drive"] = [{**SHAKER, **stiffer[name], **place, "name": name} for name, place in places.items()]
    seen = {"part": "bar", "quantity": "acceleration", "mass": 0.002, "range": 4900.0, "noise_density": 5e-4}
    table["sensor"] = [
        *(
            {**place, "channel": CELLS[name], "quantity": "force", "range": 50.0, "noise_density": 2e-4}
            for name, place in places.items()
        ),
        *({**seen, "channel": f"acc{n}", "at": at, "direction": "+y"} for n, at in enumerate((0.18, 0.3), 1)),
    ]
    return read({**table, "damping": {"modal_ratio": [0.01]}})


@pytest.fixture(scope="module")
def runs(rig, tmp_path_factory):
    """Noise and a sweep through the first mode, from either drive, as they are recorded."""
    folder, found = tmp_path_factory.mktemp("runs"), {}
    for drive, cell in CELLS.items():
        held = {"drive": drive, "target_channel": cell}
        noise = Random(**held, band=(5.0, 1000.0), rms=0.5, duration=8.0)
        around = [54.0, 56.0, 56.7, 57.4, 59.0]
        sweep = SteppedSine(**held, frequencies=around, amplitudes=[0.2], measure={"seconds": 0.5})
        for kind, procedure in (("noise", noise), ("sweep", sweep)):
            driven, path = rig.driven_by(drive), folder / f"{kind}-{drive}.mcap"
            source = open_twin(driven, procedure, preload=preload_name(rig), seed=3, source="rig")
            rehearse(procedure, source, path, nominal=NominalRig.of(driven, preload=""))
            found[kind, drive] = read_run(path)
    return found


def dense_response(rig, drive, omega):
    """Accelerations of both sensors per force at a drive, of all the bench's coordinates at once."""
    s = assemble(rig, layout=rig.bench_layout())
    modes = normal_modes(s.M, s.K0)
    shapes = s.M @ modes.Phi
    C = shapes @ np.diag(2 * 0.01 * modes.omega) @ shapes.T
    rows = np.array([s.row(rig.place_of(name)) for name in ("acc1", "acc2")])
    load = {"+y": 1, "-y": -1}[DIRECTIONS[drive]] * deflection(s, AT[drive])
    return np.array([-(w**2) * rows @ np.linalg.solve(s.K0 + 1j * w * C - w**2 * s.M, load) for w in omega])


def test_a_recording_names_its_drive_and_has_no_idle_cell(runs):
    for (_, drive), run in runs.items():
        assert run.info["drive"] == drive
        assert set(run.channels) == {CELLS[drive], "acc1", "acc2"}
        assert run.channels[CELLS[drive]].direction == DIRECTIONS[drive]


@pytest.mark.parametrize("drive", AT)
def test_the_bench_answers_to_each_drive(rig, drive):
    frequency_Hz = np.array([20.0, 57.0, 120.0, 352.0])
    built = open_bench(rig.driven_by(drive), joint_law=no_law(), setup=BenchSetup(drive="force")).built
    found = built.rig(0.0, 51200.0).transfer(frequency_Hz)[:, built.locals + built.auxiliaries + 1 :, 0]
    expected = dense_response(rig, drive, 2 * np.pi * frequency_Hz)
    assert np.all(np.abs(found - expected) < 5e-3 * np.abs(expected).max(axis=1, keepdims=True))


def test_either_drive_answers_as_if_it_were_the_only_one(rig):
    """Every receptance that an evaluation may ask for, the other drive's port apart, and their sensitivities."""
    omega, base = 2 * np.pi * np.array([20.0, 57.0, 120.0]), nominal_parameters(rig)
    both, alone = ForwardModel(blank_data(rig)), ForwardModel(blank_data(rig.driven_by("end")))
    drive = np.array([1, 0, 1])
    R = both.receptance(omega, base, np.zeros(3), drive=drive)
    expected = alone.receptance(omega, base, np.zeros(3))
    np.testing.assert_allclose(R[drive == 1], expected[drive == 1], rtol=1e-9)
    for model, found in ((both, R[[0, 2]]), (alone, expected[[0, 2]])):
        changes = model.model.sensitivity(found, omega[[0, 2]], base)
        assert np.all(np.isfinite(changes))
    first = ForwardModel(blank_data(rig)).receptance(omega, base, np.zeros(3))
    np.testing.assert_array_equal(R[1], first[1])


def test_one_model_explains_the_runs_of_both(rig, runs):
    learnt = first_look([*runs.values()], rig).passed().runs
    data = gather_data([own_channels(run, rig) for run in learnt], rig)
    assert [bins.drive for bins in data.broadband] == [0, 1]
    assert {int(drive) for drive in data.steps.drive} == {0, 1}
    for bins in data.broadband:
        inside = bins.frequency_Hz < 900.0  # the third resonance lies where the noise ends
        expected = dense_response(rig, [*AT][bins.drive], bins.omega[inside])
        missed = np.abs(bins.H[inside] - expected) / np.abs(expected).max(axis=0)
        assert np.median(missed) < 0.005, "eight seconds tell the tops of resonances to some per cent only"
    fitted = fit_base(data)
    model, steps = ResidualModel(data), data.steps
    R, omega, _ = model.step_receptance(fitted.baseline)
    missed = np.abs(model.responses(R, omega) * steps.force[:, :1] / steps.response[:, :, 0] - 1)
    for number in (0, 1):
        assert np.median(missed[steps.drive == number]) < 0.005
    exchanged = ResidualModel(replace(data, steps=replace(steps, drive=1 - steps.drive)))
    R, omega, _ = exchanged.step_receptance(fitted.baseline)
    wrong = np.abs(exchanged.responses(R, omega) * steps.force[:, :1] / steps.response[:, :, 0] - 1)
    assert np.median(wrong) > 0.5


@pytest.mark.parametrize(
    ("name", "label", "hidden", "begun", "within"),
    [
        ("drive-mass", {}, {"mass_kg": 0.006}, {"mass_kg": 0.001}, 2e-4),
        ("drive-position", {"channel": "force-end"}, {"offset_m": 0.008}, {"offset_m": 0.001}, 5e-4),
    ],
)
def test_what_is_wrong_at_a_drive_is_found_from_the_runs_of_both(rig, tmp_path, name, label, hidden, begun, within):
    """A stud between cell and beam goes from place to place with the shaker; a place that is off is one drive's own."""
    faulty, learnt = rig.model_copy(update={"effect": [Effect(cause=name, parameters={**label, **hidden})]}), []
    for drive, cell in CELLS.items():
        noise = Random(drive=drive, target_channel=cell, band=(5.0, 1000.0), rms=0.5, duration=8.0)
        driven, path = faulty.driven_by(drive), tmp_path / f"{drive}.mcap"
        source = open_twin(driven, noise, preload=preload_name(rig), seed=3, source="rig")
        rehearse(noise, source, path, nominal=NominalRig.of(rig.driven_by(drive), preload=""))
        learnt.append(read_run(path))
    data = gather_data([own_channels(run, rig) for run in learnt], rig)
    cause = CAUSES[name]
    assert label in cause.labels(data)
    without = fit_model(data, None, fit_base(data).baseline, (), options=FitOptions(iterations=30))
    fit = fit_model(
        data, None, without.baseline, (CauseHypothesis(cause, label, begun, {}),), options=FitOptions(iterations=30)
    )
    for parameter, value in hidden.items():
        assert fit.hypotheses[0].values[parameter] == pytest.approx(value, abs=within)
    assert fit.solution.chi2 < 0.5 * without.solution.chi2


def test_which_drive_a_recording_is_of(rig, runs):
    run = runs["sweep", "end"]
    silent = replace(run, info={key: value for key, value in run.info.items() if key != "drive"})
    assert drive_of(silent, rig) == "end", "by the force that its steps hold"
    held_response = replace(silent, steps=tuple(replace(step, target_channel="acc1") for step in silent.steps))
    assert drive_of(held_response, rig) == "end", "by the only force that it has"
    with pytest.raises(InputError, match="drive 'third' is none of the rig's"):
        drive_of(replace(run, info={**run.info, "drive": "third"}), rig)
    with pytest.raises(InputError, match="channel force: not recorded"):
        own_channels(replace(run, info={**run.info, "drive": "root"}), rig.driven_by("end"))
    twice = own_channels(own_channels(run, rig), rig)
    assert "force" in twice.channels
    assert twice.steps[0].target_channel == "force"


def test_a_rig_has_the_drives_of_its_file(rig):
    assert [*rig.driven_by("end").drives] == ["end", "root"]
    assert rig.driven_by("end").force_sensor.channel == "force-end"
    for one in (rig, load_rig("steel-lap-joint")):
        with pytest.raises(InputError, match="no drive 'third'"):
            one.driven_by("third")
