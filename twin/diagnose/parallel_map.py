"""Fits that do not need each other, side by side on the processor's cores.

Between the compiled kernels a fit is the interpreter's work, of which a process does one at a time; so the others are
processes of their own.  They outlive a single call, and unpack the evidence once.
"""

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from itertools import count
from operator import is_
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from twin.diagnose.limits import LIMITS
from twin.identify.time_limit import end_of_time, time_limit
from twin.joint.registry import load_laws, loaded_files

Found = TypeVar("Found")


@dataclass
class _Team:
    """Processes beside this one, and what they were sent."""

    pool: ProcessPoolExecutor
    processes: int
    packed: dict[int, tuple[tuple[Any, ...], bytes]] = field(default_factory=dict)
    numbers: Iterator[int] = field(default_factory=count)

    def pack(self, common: tuple[Any, ...]) -> tuple[int, bytes]:
        """A number for these very objects, and how they travel."""
        for number, (known, sent) in self.packed.items():
            if len(known) == len(common) and all(map(is_, known, common)):
                return number, sent
        if len(self.packed) == LIMITS.parallel_map_remembered:
            del self.packed[min(self.packed)]
        number = next(self.numbers)
        self.packed[number] = (common, pickle.dumps(common))
        return number, self.packed[number][1]


_team: ContextVar[_Team | None] = ContextVar("_team", default=None)
_known: dict[int, tuple[Any, ...]] = {}


def usual_processes() -> int:
    """One for each core, up to a few."""
    return min(os.cpu_count() or 1, LIMITS.parallel_map_most)


@contextmanager
def in_processes(number: int) -> Iterator[None]:
    """Within this context, let :func:`parallel_map` use `number` processes, this one among them, or those it has.

    They are spawned: a program that is run as a script must guard its main part by ``if __name__ == "__main__"``.
    """
    if number < 2 or _team.get() is not None:
        yield
        return
    with spawned_processes(number - 1) as pool:
        with undisturbed():
            for _ in range(number - 1):
                pool.submit(_wake)  # while the recordings are being made or read
        token = _team.set(_Team(pool, number - 1))
        try:
            yield
        finally:
            _team.reset(token)


@contextmanager
def spawned_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes for work to be submitted to, which end with the block, whatever they are doing."""
    # Spawned, not forked: numba's and BLAS's threads do not survive a fork.
    context, others = multiprocessing.get_context("spawn"), multiprocessing.active_children()
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=become_helper, initargs=(loaded_files(),))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            if process not in others:
                process.terminate()


def parallel_map(work: Callable[..., Found], common: tuple[Any, ...], each: Sequence[tuple[Any, ...]]) -> list[Found]:
    """``work(*common, *arguments)`` for the arguments of each, in their order.

    Parameters
    ----------
    work
        A function that can be pickled; so can its arguments and what it returns.
    common
        Objects that many calls share; they must not change.
    """
    team = _team.get()
    if team is None or len(each) < 2:
        return [work(*common, *arguments) for arguments in each]
    number, packed = team.pack(common)
    end_s, told = end_of_time(), np.geterr()
    todo = iter(range(len(each)))
    found: dict[int, Found] = {}

    def here() -> None:
        for index in todo:
            found[index] = work(*common, *each[index])

    def elsewhere() -> None:
        for index in todo:
            try:
                found[index] = team.pool.submit(_work, work, number, packed, each[index], end_s, told).result()
            except BrokenProcessPool:  # one was killed, perhaps for want of memory
                with time_limit(end_s), np.errstate(**told):
                    found[index] = work(*common, *each[index])

    with ThreadPoolExecutor(team.processes) as waiting:
        others = [waiting.submit(elsewhere) for _ in range(team.processes)]
        try:
            here()
            for other in others:
                other.result()
        finally:
            list(todo)  # after an error or an interrupt nothing more is begun
    return [found[index] for index in range(len(each))]


def _work(
    work: Callable[..., Found], number: int, packed: bytes, arguments: tuple[Any, ...], end_s: float, told: Any
) -> Found:
    """In a process of the team; `told` says what numpy warns of, as where the work comes from."""
    if number not in _known:
        if len(_known) == LIMITS.parallel_map_remembered:
            del _known[min(_known)]
        _known[number] = pickle.loads(packed)
    with time_limit(end_s), np.errstate(**told):
        return work(*_known[number], *arguments)


def _wake() -> None:
    """What a fit needs, imported and compiled ahead of the first one."""
    from twin.identify.forward.compiling import compile_kernels

    compile_kernels()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Processes that are started within the block never hear an interrupt; this one hears it after the block."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def become_helper(law_files: Sequence[Path] = ()) -> None:
    """Initialise a spawned process: it leaves interrupts to its parent and ends with it, whatever ended that.

    Parameters
    ----------
    law_files
        Whose laws it is to know, as its parent does.
    """
    for file in law_files:
        load_laws(file)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
