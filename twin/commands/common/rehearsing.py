"""Rehearsals in this process, or several in processes of their own: how far they are, and how they are stopped."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rich.progress import Progress, TaskID

from recordings.errors import InputError
from twin.commands.common.output import console, progress_bar, stage
from twin.commands.common.stopping import deaf

if TYPE_CHECKING:
    from twin.procedures import Procedure

SHOWN_EVERY_S = 0.1


class _Job(Protocol):
    """What can be run."""

    def run(self, meter: Meter) -> dict[str, Any]: ...


@dataclass(frozen=True)
class _Mark:
    """How far a job has come."""

    job: int
    text: str
    done: int
    total: int


class Meter:
    """Told by a rehearsal how far it is; asks it to end, as Ctrl-C would, when `stopped` says so.

    Parameters
    ----------
    put
        Takes what is to be shown, a few times a second.
    """

    def __init__(self, job: int, put: Callable[[_Mark], None], stopped: Callable[[], bool]) -> None:
        self._job, self._put, self._stopped = job, put, stopped
        self._title, self._text, self._done, self._total = "", "", 0, 1
        self._shown_s = 0.0

    def begin(self, title: str, procedure: Procedure) -> None:
        """A procedure begins."""
        from twin.procedures import planned_steps

        self._title = self._text = title
        self._done, self._total = 0, planned_steps(procedure)
        stage(f"{title}: {self._total} steps")

    def step(self, _: object) -> None:
        """One step more is measured."""
        self._done += 1

    def time(self, seconds: float) -> None:
        """Rig time that has passed; KeyboardInterrupt if it is to end."""
        if self._stopped():
            raise KeyboardInterrupt
        self._text = f"{self._title}, {seconds / 60:.1f} min of rig time"
        now_s = time.monotonic()
        if now_s - self._shown_s > SHOWN_EVERY_S:
            self._shown_s = now_s
            self._put(_Mark(self._job, self._text, self._done, self._total))


def run_here(job: _Job) -> dict[str, Any]:
    """Run one job in this process."""
    with progress_bar() as bar:
        task = bar.add_task("beginning")
        return job.run(Meter(0, lambda mark: _draw(bar, [task], mark), lambda: False))


def run_in_parallel(jobs: Sequence[_Job], names: Sequence[str]) -> list[dict[str, Any]]:
    """Run each job in a process of its own.

    An interrupt, whoever of the processes was sent it, ends all of them in order, each with what it has; so does the
    end of this process.
    """
    context = multiprocessing.get_context("spawn")
    marks, stop = context.SimpleQueue(), context.Event()
    workers = min(len(jobs), os.cpu_count() or 1)
    with (
        progress_bar() as bar,
        ProcessPoolExecutor(
            workers, mp_context=context, initializer=_become_worker, initargs=(marks, stop, console.quiet)
        ) as pool,
    ):
        tasks = [bar.add_task(f"{name}: beginning") for name in names]
        with deaf():  # they hear of it by `stop`
            running = [pool.submit(_run, job, number, f"{names[number]}: ") for number, job in enumerate(jobs)]
        while True:
            try:
                left = wait(running, timeout=SHOWN_EVERY_S).not_done
                while not marks.empty():
                    _draw(bar, tasks, marks.get())
                if not left:
                    return [one.result() for one in running]
            except KeyboardInterrupt:
                stop.set()
            except BrokenProcessPool as error:
                raise InputError(
                    "--preload", "", "the process of a rehearsal was ended from outside",
                    "if memory ran out, rehearse one preload at a time",
                ) from error  # fmt: skip


def _draw(bar: Progress, tasks: Sequence[TaskID], mark: _Mark) -> None:
    bar.update(tasks[mark.job], description=mark.text, completed=mark.done, total=mark.total)


_worker: dict[str, Any] = {}


def _become_worker(marks: Any, stop: Any, quiet: bool) -> None:
    console.quiet = quiet
    parent, asked = os.getppid(), threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: asked.set())  # which the pool sends where another process was killed
    _worker.update(
        marks=marks,
        orphaned=lambda: os.getppid() != parent,
        stopped=lambda: stop.is_set() or asked.is_set() or os.getppid() != parent,
    )


def _run(job: _Job, number: int, prefix: str) -> dict[str, Any]:
    def put(mark: _Mark) -> None:
        _worker["marks"].put(_Mark(mark.job, prefix + mark.text, mark.done, mark.total))

    try:
        return job.run(Meter(number, put, _worker["stopped"]))
    finally:
        if _worker["orphaned"]():
            os._exit(1)  # the pool would wait for ever for the next job
