"""No two assemblies of a rig have the same natural frequencies; which one it is, the seed says."""

import numpy as np
from clamped_beam import LAB
from scipy.linalg import eigh

from twin.bench import open_bench
from twin.bench.build import altered_matrices
from twin.bench.planned import planned


def natural_frequencies(plan):
    matrices, _ = altered_matrices(plan)
    return np.sqrt(eigh(matrices.K0, matrices.M, eigvals_only=True, subset_by_index=(0, 7)))


def with_table(**values):
    return LAB.rig.model_copy(update={"natural_frequencies": LAB.rig.natural_frequencies.model_copy(update=values)})


def test_offsets_act_on_the_first_natural_frequencies():
    offset = [0.01, -0.02, 0.005]
    ratio = natural_frequencies(planned(with_table(offset=offset))) / natural_frequencies(planned(LAB.rig))
    np.testing.assert_allclose(ratio**2, [1.02, 0.96, 1.01, *[1.0] * 5], rtol=1e-6)


def test_scatter_is_drawn_by_the_seed():
    rig = with_table(scatter=0.003)
    plans = [open_bench(rig, seed=seed)._plan for seed in (1, 1, *range(2, 30))]
    ratios = np.array([natural_frequencies(plan) for plan in plans]) / natural_frequencies(planned(LAB.rig)) - 1
    np.testing.assert_array_equal(ratios[0], ratios[1])
    assert 0.0025 < np.std(ratios[1:]) < 0.0035
    assert abs(np.corrcoef(ratios[1:, 0], ratios[1:, 1])[0, 1]) < 0.5


def test_a_rig_without_the_table_is_the_same_for_every_seed():
    assert len(open_bench(LAB.rig, seed=3)._plan.frequency_errors) == 0
