"""Natural frequencies as evidence: textbook beams that hide something, the papers' tables, what is not claimed."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from recordings.tables import FrequencyTable
from studies.tables import load_study
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem
from twin.diagnose.model_evidence import infer_errors
from twin.diagnose.models import CAUSES
from twin.diagnose.tables import diagnose_frequencies, felt_causes
from twin.diagnose.tables.frequencies import threshold
from twin.identify.base_fit import fit_base
from twin.identify.residuals.error_model import SPREAD, log_prior
from twin.identify.residuals.frequency_model import FrequencyModel, sound_errors
from twin.identify.residuals.natural_frequencies import measured_frequencies
from twin.rigs import load_rig
from twin.rigs.beam import BeamRig
from twin.rigs.store import load_any_rig
from twin.structure import assemble, normal_modes, with_mass_at

BEAM = BeamRig.model_validate(
    {
        "kind": "beam", "name": "strip", "support": "clamped", "elements": 30,
        "beam": {"length": 0.4, "width": 0.03, "thickness": 0.004, "youngs_modulus": 200e9, "density": 7850.0},
    }
)  # fmt: skip


def cantilever(modes, *, tip_mass_ratio=0.0, modulus=200e9):
    """Frequencies of a clamped strip with a mass at its tip, from the roots of the textbook's equation."""

    def equation(x):
        c, s = np.cos(x), np.sin(x)
        # Divided by cosh, so that high modes do not overflow.
        return 1 / np.cosh(x) + c + tip_mass_ratio * x * (c * np.tanh(x) - s)

    grid = np.linspace(0.1, (modes + 1) * np.pi, 4000)
    values = equation(grid)
    crossing = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[:modes]
    roots = np.array([brentq(equation, grid[i], grid[i + 1]) for i in crossing])
    b = BEAM.beam
    return roots**2 / (2 * np.pi * b.length**2) * np.sqrt(modulus * b.second_moment / (b.density * b.area))


def table(frequencies, *, std=None, preload="", path="table.csv"):
    f = np.asarray(frequencies, float)
    n = len(f)
    std_Hz = np.full(n, np.nan) if std is None else std * f
    return FrequencyTable(
        path=path, mode=np.arange(1, n + 1), frequency_Hz=f, std_Hz=std_Hz, preload=(preload,) * n,
        line=np.arange(2, n + 2),
    )  # fmt: skip


def coarse(rig, elements=20):
    """The rig with a mesh that is quick and, compared with itself, exact."""
    return rig.model_copy(update={"mesh": rig.mesh.model_copy(update={"beam_elements": elements})})


def test_a_mass_at_the_tip_of_a_textbook_cantilever_is_named_placed_and_weighed():
    b = BEAM.beam
    own = b.density * b.area * b.length
    generator = np.random.default_rng(1)
    f = cantilever(6, tip_mass_ratio=0.15, modulus=190e9) * np.exp(5e-4 * generator.standard_normal(6))
    found = diagnose_frequencies([table(f, std=5e-4)], BEAM)
    assert (found.verdict, found.causes[0].cause) == ("explained", "added-mass")
    mass, place = (found.causes[0].parameters[name] for name in ("mass_kg", "position_m"))
    assert abs(mass.value - 0.15 * own) < 3 * mass.std < 0.1 * own
    assert abs(place.value - b.length) < 3 * place.std < 0.1 * b.length
    modulus = found.parameters["youngs_modulus"][1]
    assert abs(modulus.value - 190e9) < 3 * modulus.std
    assert found.gain.after < 0.2 * found.gain.before
    assert found.model.effect[0].cause == "added-mass"


@pytest.mark.parametrize("std", [pytest.param(1e-3, marks=pytest.mark.slow), None])
@pytest.mark.slow
def test_a_plain_textbook_cantilever_is_found_right(std):
    for seed in range(2):
        generator = np.random.default_rng(seed)
        f = cantilever(5, modulus=215e9) * np.exp(1e-3 * generator.standard_normal(5))
        found = diagnose_frequencies([table(f, std=std)], BEAM)
        assert found.verdict == "none"
        assert not any(cause.in_model for cause in found.causes)
        assert found.misfit.chi2_per_dof < found.misfit.threshold
        assert found.parameters["youngs_modulus"][1].value == pytest.approx(215e9, rel=5e-3)


def test_frequencies_that_no_beam_has_are_explained_by_nothing():
    f = cantilever(5) * np.array([1.0, 1.2, 0.8, 1.25, 0.8])
    found = diagnose_frequencies([table(np.sort(f), std=1e-3)], BEAM)
    assert found.verdict == "unknown"
    assert not any(cause.in_model for cause in found.causes)
    assert found.gain.before == found.gain.after


@pytest.fixture(scope="module")
def composite():
    return diagnose_frequencies(
        [table(load_study("composite-beam").condition["free"].measured)], load_any_rig("composite-beam")
    )


@pytest.mark.slow
def test_the_composite_beams_four_frequencies_name_shear_with_its_rivals_and_gain(composite):
    first = composite.causes[0]
    assert (first.cause, first.in_model) == ("transverse-shear", True)
    assert composite.verdict == "ambiguous"
    assert composite.set_95[0] == "transverse-shear"
    ratio = first.parameters["modulus_ratio"]
    assert ratio.value == pytest.approx(15.9, abs=0.5)
    assert 1 < ratio.std < 5
    assert composite.gain.after < 0.6 * composite.gain.before
    assert composite.misfit.chi2_per_dof > composite.misfit.threshold > composite.misfit.after


@pytest.mark.slow
def test_what_beliefs_and_not_data_decide_is_said(composite):
    assert any("alone favour stiffness-loss" in note for note in composite.notes)
    assert any("0.1 % is assumed" in note for note in composite.notes)
    assert any("stiffness-loss at 0.01" in text for text in composite.assumed)
    assert any("would tell them apart" in note for note in composite.notes)


@pytest.fixture(scope="module")
def steel():
    study = load_study("steel-lap-joint")
    tables = [table(c.measured, preload=name, path=f"{name}.csv") for name, c in study.condition.items()]
    return diagnose_frequencies(tables, coarse(load_rig("steel-lap-joint-light-sensors")))


@pytest.mark.slow
def test_the_steel_beams_eight_frequencies_name_a_mass_near_the_tip(steel):
    assert (steel.verdict, steel.causes[0].cause) == ("explained", "added-mass")
    mass, place = (steel.causes[0].parameters[name] for name in ("mass_kg", "position_m"))
    assert 0.017 < mass.value < 0.022
    assert 0.40 < place.value <= 0.42
    assert steel.gain.before > 10 * steel.gain.after
    assert {model.hypotheses for model in steel.tried} >= {
        "nothing",
        "added-mass",
        "clamp-compliance",
        "stiffness-loss",
    }
    assert steel.set_95 == ("added-mass",)
    assert {limit.cause for limit in steel.excluded} >= {"clamp-compliance", "drive-mass"}
    assert set(steel.model.joint.preload) == {"120N", "540N"}


@pytest.mark.slow
def test_loading_the_extended_rig_as_believed_leaves_nothing_to_blame(steel):
    study = load_study("steel-lap-joint")
    tables = [table(c.measured, preload=name) for name, c in study.condition.items()]
    again = diagnose_frequencies(tables, steel.model, most=0)
    assert (again.verdict, again.shortfall) == ("none", "")
    assert again.misfit.chi2_per_dof < 5
    name = "normal_modulus[120N]"
    assert again.parameters[name][1].value == pytest.approx(steel.parameters[name][1].value, rel=0.05)


def test_causes_act_as_structures_assembled_by_themselves():
    rig = coarse(load_rig("steel-lap-joint"))
    evidence = measured_frequencies([table([26.5, 157.6, 471.8, 895.0], preload="120N")], rig)
    softer = rig.model_copy(update={"upper": rig.upper.model_copy(update={"youngs_modulus": 0.9 * 198e9})})
    (E,), (G,) = evidence.nominal.E, evidence.nominal.G
    at = rig.layout().place(0.3)
    expected = {
        "added-mass": ({}, with_mass_at(assemble(rig), at, 0.05), {"mass_kg": 0.05, "position_m": 0.3}),
        "clamp-compliance": (
            {}, assemble(rig, layout=rig.layout().with_yielding_supports(1 / 2e3)), {"rotational_rad_per_Nm": 1 / 2e3},
        ),
        "beam-modulus": ({"beam": "upper"}, assemble(softer), {"factor": 0.9}),
    }  # fmt: skip
    for name, (label, structure, values) in expected.items():
        modification = CAUSES[name].modification(evidence, label, values)
        found = FrequencyModel(evidence, modification).frequencies(evidence.tables[0], evidence.nominal)
        modes = normal_modes(structure.M, structure.stiffness(E, G), 4)
        assert found == pytest.approx(modes.frequency_Hz, rel=1e-7)


def test_only_causes_that_frequencies_feel_are_tried():
    named = set(felt_causes(measured_frequencies([table([26.5, 157.6])], load_rig("steel-lap-joint"))))
    assert named >= {"added-mass", "joint-stiffness", "joint-uneven", "stinger-stiffness", "drive-mass"}
    assert not named & {"channel-gain", "viscous-damper", "cubic-stiffness", "sensor-position", "attached-resonator"}
    alone = set(felt_causes(measured_frequencies([table(cantilever(3))], BEAM.structure())))
    assert alone == {"added-mass", "stiffness-loss", "transverse-shear", "clamp-compliance"}


@pytest.mark.parametrize("name", ["steel-lap-joint", "two-lap-joints", "strip"])
def test_sensitivities_are_those_of_differences(name):
    rig = BEAM.structure() if name == "strip" else load_rig(name)
    evidence = measured_frequencies([table([26.5, 157.6, 471.8, 895.0])], rig)
    mass = CAUSES["added-mass"]
    on_it = CauseHypothesis(mass, mass.labels(evidence)[0], {"mass_kg": 0.02, "position_m": 0.13}, {})
    problem = FitProblem(evidence, None, fit_base(evidence).baseline, (on_it,))
    x = problem.x0
    J = problem.weighed().evaluate(x).jacobian
    felt = [*evidence.where.values(), *range(problem.count, len(x))]

    def residual(x):
        return problem.residual_model(x).evaluate(problem.baseline(x), sensitivities=False).residual

    for k in felt:
        step = np.zeros(len(x))
        # Smaller steps drown in the rounding of eigenvalues, on some processors.
        step[k] = 1e-2
        difference = (residual(x - step) - residual(x + step)) / 2e-2
        assert J[:, k] == pytest.approx(difference, rel=2e-2, abs=2e-2 * np.abs(difference).max())
    assert not np.delete(J, felt, axis=1).any()


def test_evidence_of_the_modulus_alone_is_its_integral():
    """The frequencies of a slender beam go as the root of the modulus, so that the integral has one dimension."""
    f = cantilever(3, modulus=230e9) * np.array([1.001, 0.9995, 1.0002])
    evidence = measured_frequencies([table(f, std=1e-3)], BEAM.structure())
    unit = cantilever(3, modulus=1.0)
    found = FitProblem(evidence, None, fit_base(evidence).baseline, ())
    errors, log_evidence = infer_errors(found, None)
    std = np.hypot(1e-3, errors.steps.stiffness / 2)
    shift = 6e-5  # of all frequencies at once, which the evidence integrates over as well
    covariance = std**2 * np.eye(3) + shift**2 * np.ones((3, 3))

    def integrand(log_modulus):
        r = np.log(f / unit) - log_modulus / 2
        prior = np.exp(-0.5 * ((log_modulus - np.log(200e9)) / 0.5) ** 2) / (0.5 * np.sqrt(2 * np.pi))
        return np.exp(-0.5 * r @ np.linalg.solve(covariance, r)) * prior

    centre = float(np.mean(2 * np.log(f / unit)))
    integral = quad(integrand, centre - 0.02, centre + 0.02, epsrel=1e-8)[0]
    expected = np.log(integral) - 0.5 * np.linalg.slogdet(covariance)[1] + log_prior(errors, sound_errors(evidence))
    assert log_evidence == pytest.approx(expected, abs=0.05)


def test_a_strength_of_one_sign_has_twice_the_prior_density():
    evidence = measured_frequencies([table(cantilever(4), std=1e-3)], BEAM.structure())
    shear = CauseHypothesis(CAUSES["transverse-shear"], {"beam": "strip"}, {"modulus_ratio": 1.0}, {})
    problem = FitProblem(evidence, None, fit_base(evidence).baseline, (shear,))
    assert problem.log_prior_mass == pytest.approx(-np.log(2))


def test_a_right_model_exceeds_the_threshold_as_rarely_as_it_says():
    generator = np.random.default_rng(0)
    for stated in (True, False):
        scale = np.ones(200_000) if stated else np.exp(SPREAD * generator.standard_normal(200_000))
        drawn = scale**2 * generator.chisquare(4, 200_000) / 4
        assert np.mean(drawn > threshold(stated, 4)) == pytest.approx(0.01, abs=0.002)


@pytest.mark.slow
def test_a_table_that_was_held_out_measures_the_gain():
    f = cantilever(6, tip_mass_ratio=0.1)
    kept = FrequencyTable(
        path="kept.csv", mode=np.array([6]), frequency_Hz=f[5:], std_Hz=np.array([np.nan]), preload=("",),
        line=np.array([2]),
    )  # fmt: skip
    found = diagnose_frequencies([table(f[:5], std=1e-3)], BEAM, held_out=[kept])
    assert found.gain.runs == ("kept.csv",)
    assert found.gain.after < 0.1 * found.gain.before


def test_masses_that_the_rig_file_owes_its_agreement_to_are_told():
    """The shipped rig's heavy tip sensor was itself inferred from these frequencies."""
    study = load_study("steel-lap-joint")
    tables = [table(c.measured, preload=name) for name, c in study.condition.items()]
    found = diagnose_frequencies(tables, coarse(load_rig("steel-lap-joint")), most=0)
    assert found.verdict == "none"
    (note,) = [note for note in found.notes if "agreement rests on" in note]
    assert "22 g" in note
    assert "acc2" in note
    assert 17 < float(note.split("added mass of ")[1].split()[0]) < 22


@pytest.mark.slow
def test_a_joint_as_believed_but_for_its_moduli_is_found_right():
    """A shear modulus a third too low: fits begun from what is assumed alone end in a minimum of another mode."""
    rig = coarse(load_rig("steel-lap-joint"))
    structure = assemble(rig)
    modes = normal_modes(structure.M, structure.stiffness(3.33e8, 5.06e7), 12)
    across = structure.counted
    share = np.einsum("im,im->m", modes.Phi[across], structure.M[np.ix_(across, across)] @ modes.Phi[across])
    f = modes.frequency_Hz[share > 0.5][:6] * np.exp(5e-4 * np.random.default_rng(101).standard_normal(6))
    found = diagnose_frequencies([table(f, std=1e-3, preload="120N")], rig, most=1)
    assert (found.verdict, found.set_95) == ("none", ("none",))
    assert found.parameters["shear_modulus[120N]"][1].value == pytest.approx(5.06e7, rel=0.1)
