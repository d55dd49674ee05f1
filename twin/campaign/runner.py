"""Run many cases on all cores or on a cluster; each result is on disk as soon as it is there."""

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from recordings.errors import InputError
from recordings.whole import whole_file
from twin.campaign.case import CasePlan, CaseResult, run_case
from twin.campaign.limits import LIMITS
from twin.diagnose.parallel_map import spawned_processes, undisturbed
from twin.rigs import Rig

CASES, RECORDINGS = "cases", "recordings"
"""Folders of the results and of kept recordings."""


def run_campaign(
    plans: Sequence[CasePlan],
    rig: Rig,
    folder: Path,
    *,
    workers: int | str | None = None,
    keep: bool = False,
    time_limit_s: float = math.inf,
    on_result: Callable[[CaseResult], None] = lambda result: None,
    report: Callable[[str], None] = lambda text: None,
) -> list[CaseResult]:
    """Run the cases that `folder` does not hold yet, or only as failed, and return all in the order of the plans.

    Parameters
    ----------
    folder
        Holds ``cases/NAME.json`` for each finished case; written one by one, so that an interruption loses only those
        that are running.
    workers
        Local processes, one for each core if not given; or the address of a Dask scheduler to use instead, such as
        ``tcp://host:8786``.
    keep
        Keep the recordings in ``recordings/NAME``; with a scheduler, on a file system that the workers share.
    time_limit_s
        Of each diagnosis.
    on_result
        Told of each result as it comes, those of an earlier session first.
    report
        Told what begins, once nothing stands in its way.

    Raises
    ------
    InputError
        If `folder` holds cases of another rig, a worker dies, or the scheduler cannot be reached.
    """
    earlier = {result.plan: result for result in read_results(folder) if not result.error}
    done = {plan: earlier[plan] for plan in plans if plan in earlier}
    for result in done.values():
        if result.rig != rig.name:
            raise InputError(folder, "", f"holds cases of the rig {result.rig}, not {rig.name}", "name another --out")
        on_result(result)
    todo = [plan for plan in plans if plan not in done]
    if todo:
        with _executor(workers, len(todo)) as executor:
            # Before the first case has run for a minute, but not where no one would run it.
            (folder / CASES).mkdir(parents=True, exist_ok=True)
            report(f"diagnosing {len(todo)} cases")
            recordings = {plan: (folder / RECORDINGS / plan.name).resolve() if keep else None for plan in todo}
            with undisturbed():
                futures = [
                    executor.submit(run_case, plan, rig, recordings[plan], time_limit_s=time_limit_s) for plan in todo
                ]
            for future in as_completed(futures):
                try:
                    result = future.result()
                except BrokenProcessPool as error:
                    reason = "a worker process died, perhaps for want of memory"
                    hint = "give fewer --workers; the same command goes on where it ended"
                    raise InputError(folder, "", reason, hint) from error
                _write(result, folder)
                done[result.plan] = result
                on_result(result)
    return [done[plan] for plan in plans]


def read_results(folder: Path) -> list[CaseResult]:
    """All finished cases of a campaign.

    Raises
    ------
    InputError
        If a file is not what :func:`run_campaign` writes.
    """
    results = []
    for path in sorted((folder / CASES).glob("*.json")):
        try:
            results.append(CaseResult.from_dict(json.loads(path.read_text(encoding="utf-8"))))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise InputError(path, "", f"is not a case of a campaign ({error})", "delete it to run it again") from error
    return results


def _write(result: CaseResult, folder: Path) -> None:
    with whole_file(folder / CASES / f"{result.plan.name}.json") as part:
        part.write_text(json.dumps(result.to_dict(), indent=1, default=float) + "\n", encoding="utf-8")


def _executor(workers: int | str | None, most: int) -> AbstractContextManager[Executor]:
    if isinstance(workers, str):
        return _dask(workers)
    return spawned_processes(min(workers or os.cpu_count() or 1, most))


@contextmanager
def _dask(scheduler: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("--scheduler", "", "needs Dask", "install it with the extra 'cluster'") from error
    try:
        client = Client(scheduler, timeout=f"{LIMITS.scheduler_s:g}s")
    except (OSError, ValueError) as error:
        raise InputError("--scheduler", scheduler, f"cannot be reached: {error}", "start dask-scheduler") from error
    with client:
        executor = client.get_executor(pure=False, retries=1)
        try:
            yield executor
        finally:
            executor.shutdown(wait=False)
