"""Work that is shared among processes: the same answers, in their order, whatever happens to the others."""

import multiprocessing
import operator
import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose import in_processes
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.models import CAUSES
from twin.diagnose.parallel_map import parallel_map
from twin.identify.base_fit import fit_base
from twin.identify.measured_data import gather_data
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig


@pytest.fixture(scope="module", params=[1, 2, 3])
def processes(request):
    with in_processes(request.param):
        yield request.param


def test_answers_come_in_the_order_of_the_questions(processes):
    assert parallel_map(operator.mul, (7,), [(n,) for n in range(40)]) == [7 * n for n in range(40)]
    assert parallel_map(operator.mul, (7,), []) == []


def test_what_is_common_may_change_from_call_to_call(processes):
    answers = [parallel_map(operator.add, (np.full(3, c),), [(1,), (2,)])[1][0] for c in range(9)]
    assert answers == [c + 2 for c in range(9)]


def test_an_error_anywhere_is_raised_and_nothing_hangs(processes):
    with pytest.raises(ZeroDivisionError):
        parallel_map(operator.truediv, (1.0,), [(n - 5.0,) for n in range(11)])
    assert parallel_map(operator.truediv, (1.0,), [(2.0,), (4.0,)]) == [0.5, 0.25]


def test_a_process_that_is_killed_leaves_its_work_to_this_one():
    with in_processes(2):
        parallel_map(operator.mul, (7,), [(n,) for n in range(4)])

        def kill():
            time.sleep(0.3)
            for process in multiprocessing.active_children():
                process.kill()

        killer = threading.Thread(target=kill)
        killer.start()
        slept = parallel_map(time.sleep, (), [(0.1,) for _ in range(12)])
        killer.join()
        assert slept == [None] * 12
        assert parallel_map(operator.mul, (7,), [(n,) for n in range(4)]) == [0, 7, 14, 21]


def test_who_asks_for_processes_among_others_is_given_these():
    with in_processes(2):
        parallel_map(operator.mul, (7,), [(1,), (2,)])
        begun = set(multiprocessing.active_children())
        with in_processes(2):
            assert parallel_map(operator.mul, (7,), [(1,), (2,)]) == [7, 14]
            assert set(multiprocessing.active_children()) == begun


def test_processes_that_are_done_with_are_gone():
    before = set(multiprocessing.active_children())
    with in_processes(2):
        parallel_map(operator.mul, (7,), [(1,), (2,)])
    deadline = time.monotonic() + 60
    while set(multiprocessing.active_children()) - before and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not set(multiprocessing.active_children()) - before


ORPHANS = """
import multiprocessing, time
from concurrent.futures import ProcessPoolExecutor
from twin.diagnose.parallel_map import become_helper

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, initializer=become_helper) as pool:
        pool.submit(time.sleep, 0).result()
        work = pool.submit(time.sleep, 600)
        print(*[process.pid for process in multiprocessing.active_children()], flush=True)
        work.result()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_helper_ends_with_a_killed_parent_in_the_middle_of_its_work(tmp_path):
    (script := tmp_path / "parent.py").write_text(ORPHANS)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as parent:
        helpers = [Path("/proc", pid) for pid in parent.stdout.readline().split()]
        parent.kill()
    assert helpers
    deadline = time.monotonic() + 60
    while any(helper.exists() for helper in helpers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(helper.exists() for helper in helpers)


STARTING = """
import time
from twin.diagnose.parallel_map import in_processes

if __name__ == "__main__":
    try:
        with in_processes(3):
            print("started", flush=True)
            time.sleep(60)
    except KeyboardInterrupt:
        print("interrupted")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sends a signal to a group of processes")
def test_helpers_that_are_starting_hear_no_interrupt(tmp_path):
    (script := tmp_path / "parent.py").write_text(STARTING)
    with subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as parent:
        parent.stdout.readline()
        time.sleep(0.3)  # they are importing
        os.killpg(parent.pid, signal.SIGINT)
        assert parent.communicate(timeout=60) == ("interrupted\n", "")


@pytest.fixture(scope="module")
def fitted(campaign):
    evidence = gather_data([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))
    return evidence, fit_base(evidence).baseline


def test_a_fit_elsewhere_is_the_fit_here(fitted):
    """With the evidence sent without its samples; of causes whose fits do not hinge on rounding."""
    evidence, baseline = fitted
    field = [
        (baseline, (CauseHypothesis(CAUSES["added-mass"], {}, {"mass_kg": mass, "position_m": position}, {}),))
        for mass in (1e-4, 1e-3)
        for position in (0.2, 0.3)
    ]
    settled = partial(fit_model, options=FitOptions(tolerance=1e-3, iterations=30))
    alone = parallel_map(settled, (evidence, None), field)
    with in_processes(2):
        together = parallel_map(settled, (evidence, None), field)
    for one, other in zip(alone, together, strict=True):
        assert one.solution.cost == pytest.approx(other.solution.cost, rel=1e-6)
        apart = one.solution.x - other.solution.x
        assert apart @ one.solution.information @ apart < 1e-2**2  # in deviations: sums may round differently there


def residual_of(evidence, baseline, hypothesis):
    return (
        ResidualModel(evidence, modification_of(evidence, (hypothesis,)))
        .evaluate(baseline, sensitivities=False)
        .residual
    )


@pytest.mark.slow
def test_structures_are_built_elsewhere_as_they_are_here(fitted):
    """Up to the rounding of their modes, which need not be the same in two processes."""
    field = [
        (CauseHypothesis(CAUSES["beam-modulus"], {"beam": beam}, {"factor": factor}, {}),)
        for beam in ("lower", "upper")
        for factor in (0.99, 1.01)
    ]
    alone = parallel_map(residual_of, fitted, field)
    with in_processes(2):
        together = parallel_map(residual_of, fitted, field)
    for one, other in zip(alone, together, strict=True):
        assert np.linalg.norm(one - other) < 1e-6 * np.linalg.norm(one)
    assert all(np.linalg.norm(one - alone[0]) > 0.1 * np.linalg.norm(one) for one in alone[1:])
