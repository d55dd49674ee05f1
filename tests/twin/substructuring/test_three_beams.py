"""A part known by noisy responses only, bolted between two models: responses and joints against the whole."""

from __future__ import annotations

import numpy as np
import pytest
from three_beams import (
    LINES_HZ,
    LOSS,
    SENSORS,
    STIFFNESS,
    away_from_antiresonances,
    files,
    measured_part,
    noisy,
    rig_text,
    whole,
    write,
)

from recordings.errors import InputError
from recordings.responses import read_responses
from twin.lab.coupled import couple
from twin.rigs.store import load_substructures
from twin.substructuring import gather_substructures, identify_joints, predict

POINTS = ["b1", "b2", "b3", "b4"]


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """Three seeds, from joints that are off by factors of two and more, without damping."""
    found = []
    for seed in (11, 12, 13):
        folder = tmp_path_factory.mktemp("beams")
        rig = files(folder, np.random.default_rng(seed))
        exact = predict(gather_substructures(load_substructures(rig)))
        rig.write_text(rig_text((0.4, 2.5, 0.5, 2.0), loss=0.0))
        parts = gather_substructures(load_substructures(rig))
        found.append((exact, identify_joints(parts, read_responses(folder / "coupled.npz"))))
    return found


def test_with_known_joints_the_coupled_response_is_the_whole_ones(identified):
    away = away_from_antiresonances(whole())
    assert away.mean() > 0.98
    for exact, _ in identified:
        error = np.abs(exact.H[:, :, 0] / whole() - 1)[away]
        assert np.sqrt(np.mean(error**2)) < 0.003
        assert np.mean(error < 0.01) > 0.99  # the rest is on the tip of the sharpest resonance
        assert error.max() < 0.03


def test_joints_are_found_from_afar_and_the_response_with_them(identified):
    for _, fit in identified:
        found = np.array([*fit.values.stiffness.values()])
        assert found == pytest.approx(STIFFNESS, rel=0.002)
        assert [*fit.values.loss_factor.values()] == pytest.approx([LOSS] * 4, rel=0.05)
        error = np.abs(fit.after.H[:, :, 0] / whole() - 1)[away_from_antiresonances(whole())]
        assert error.max() < 0.01
        before, after = fit.errors
        assert before > 0.05
        assert after < 0.0015
        assert fit.chi2_per_dof == pytest.approx(1, abs=0.1)
        assert fit.notes == ()


def test_deviations_are_of_the_size_of_the_errors(identified):
    """Over all seeds and joints; meshes differ by more than the noise leaves of the softest bolt."""
    pulls = []
    for _, fit in identified:
        std = np.array([*fit.values.stiffness_std.values()])
        pulls += [*((np.array([*fit.values.stiffness.values()]) - STIFFNESS) / std)]
        pulls += [*((np.array([*fit.values.loss_factor.values()]) - LOSS) / np.array([*fit.values.loss_std.values()]))]
    assert 0.4 < np.sqrt(np.mean(np.square(pulls))) < 2.5


def test_raw_responses_with_the_same_noise_would_be_useless():
    """Why they are synthesised first."""
    exact, low = np.linalg.inv(measured_part()), slice(0, 100)
    off = np.linalg.inv(noisy(measured_part(), np.random.default_rng(1))) - exact
    assert np.median(np.linalg.norm(off[low], axis=(1, 2)) / np.linalg.norm(exact[low], axis=(1, 2))) > 0.3


BROKEN = {
    "a pair is missing": (lambda f: write(f / "b.npz", measured_part()[:, :3, :3], POINTS[:3], POINTS[:3]),
                          "no response of b1 to"),
    "no such file": (lambda f: (f / "b.npz").unlink(), "no such file"),
    "no unit": (lambda f: np.savez(f / "b.npz", frequency_Hz=LINES_HZ, frf=np.moveaxis(measured_part(), 0, 2),
                                   channels=POINTS, references=POINTS), "says no unit"),
    "rubbish": (lambda f: (f / "b.npz").write_bytes(b"rubbish"), "no NumPy archive"),
    "other lines": (lambda f: np.savez(f / "coupled.npz", frequency_Hz=2000 + np.arange(996.0), frf=whole().T,
                                       channels=[n for n, *_ in SENSORS], frf_form="accelerance"), "0 lines from 5"),
    "none of the rig's": (lambda f: write(f / "coupled.npz", whole()[:, :, None], ["x", "y"], ["z"]), "none of its"),
    "a point of no name": (lambda f: edit(f, '"b1"', '"b9"'), "b9"),
    "a number for a point": (lambda f: edit(f, '"b1"', "0.1"), "'b' is joined at a point"),
    "two motions of a point": (lambda f: edit(f, "{ y = 2000000.0 }", "{ y = 1e6, x = 1e6 }"), "one axis"),
    "beyond the end": (lambda f: edit(f, "at = [0.255,", "at = [0.9,"), "beyond the end"),
    "closed twice": (lambda f: edit(f, "stiffness = { y = 2000000.0 }", 'rigid = ["y"]',
                                    more='\n[[connection]]\nname = "again"\nbetween = ["a", "b"]\nat = [0.255, "b1"]\n'
                                    'rigid = ["y"]\n'), "closed rigidly twice"),
    "a part that nothing joins": (lambda f: edit(f, 'name = "b"', 'name = "d"'), "no part 'b'"),
    "nothing to identify": (lambda f: edit(f, "stiffness = { y =", 'rigid = ["y"] #', every=True), "all are rigid"),
}  # fmt: skip


def edit(folder, old, new, *, more="", every=False):
    text = (folder / "rig.toml").read_text()
    assert old in text
    (folder / "rig.toml").write_text(text.replace(old, new, -1 if every else 1) + more)


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_wrong_is_one_line(what, tmp_path):
    rig = files(tmp_path, np.random.default_rng(5))
    breaks, reason = BROKEN[what]
    breaks(tmp_path)
    with pytest.raises(InputError) as told:
        couple(rig, measured=tmp_path / "coupled.npz")
    assert reason in str(told.value)
    assert "\n" not in str(told.value)
