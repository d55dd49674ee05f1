"""Telling how a long job goes: a line a stage, and a bar with what is done in it."""

from __future__ import annotations

import time

from rich.progress import TaskID

from twin.commands.common.output import progress_bar, say, stage


class Stages:
    """Progress over stages: how long each lasts nobody knows, but of some the share that is done."""

    def __init__(self) -> None:
        self._started = self._stage_started = time.perf_counter()
        self._stage = ""
        self._task: TaskID | None = None
        self._bar = progress_bar()
        self.seconds: dict[str, float] = {}
        """What each finished stage took."""

    def __enter__(self) -> Stages:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._close_stage()
        self._bar.stop()

    @property
    def elapsed_s(self) -> float:
        """Since the beginning."""
        return time.perf_counter() - self._started

    def begin(self, name: str, text: str) -> None:
        """Start a stage and say so."""
        self._close_stage()
        self._stage, self._stage_started = name, time.perf_counter()
        self._task = self._bar.add_task(text, total=None)
        self.say(text)

    def say(self, text: str) -> None:
        """A line that stays, with the time at which it was said."""
        say((f"{self.elapsed_s:5.1f} s", "dim"), f"  {text}")

    def turn(self, text: str) -> None:
        """Another part of the stage begins."""
        stage(f"{self.elapsed_s:5.1f} s  {text}")
        self.update(text)

    def update(self, text: str, share: float | None = None) -> None:
        """What is being done just now, and the share of the stage that is done, where it can be counted."""
        assert self._task is not None
        self._bar.update(self._task, description=text, completed=share, total=None if share is None else 1.0)

    def _close_stage(self) -> None:
        if self._task is not None:
            self._bar.remove_task(self._task)
            self.seconds[self._stage] = time.perf_counter() - self._stage_started
