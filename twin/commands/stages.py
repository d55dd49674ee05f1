"""Telling how a long job goes: a line a stage, and one bar with the time that is left of it all."""

from __future__ import annotations

import time
from types import TracebackType

from rich.progress import BarColumn, Progress, TaskID, TextColumn

from twin.commands.output import console, say

__all__ = ["Stages"]


class Stages:
    """Progress over stages whose usual durations are known.

    Parameters
    ----------
    usual_s
        Seconds that each stage usually takes, in order.
    """

    def __init__(self, usual_s: dict[str, float]) -> None:
        self._usual_s = usual_s
        self._order = list(usual_s)
        self._started = time.perf_counter()
        self._stage = self._order[0]
        self._stage_started = self._started
        self.seconds: dict[str, float] = {}
        """What each finished stage took."""
        self._bar = Progress(
            TextColumn("  {task.description}", markup=False), BarColumn(bar_width=30),
            TextColumn("{task.fields[left]}"), console=console, transient=True,
        )  # fmt: skip
        self._task: TaskID = self._bar.add_task("", total=sum(usual_s.values()), left="")

    def __enter__(self) -> Stages:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close_stage()
        self._bar.stop()

    @property
    def elapsed_s(self) -> float:
        """Since the beginning."""
        return time.perf_counter() - self._started

    def begin(self, stage: str, text: str) -> None:
        """Start a stage and say so."""
        self._close_stage()
        self._stage, self._stage_started = stage, time.perf_counter()
        self.say(text)
        self.update(text)

    def say(self, text: str) -> None:
        """A line that stays, with the time at which it was said."""
        say((f"{self.elapsed_s:5.1f} s", "dim"), f"  {text}")

    def update(self, text: str, share: float | None = None) -> None:
        """What is being done just now; `share` of the stage is done, by its usual duration if not given."""
        usual = self._usual_s[self._stage]
        inside = time.perf_counter() - self._stage_started
        done = usual * share if share is not None else usual * inside / (inside + 0.5 * usual)
        before = sum(self._usual_s[name] for name in self._order[: self._order.index(self._stage)])
        after = sum(self._usual_s[name] for name in self._order[self._order.index(self._stage) + 1 :])
        here = (inside / share - inside) if share else max(usual - inside, 0.1 * usual)
        self._bar.update(self._task, completed=before + done, description=text, left=f"{here + after:.0f} s left")

    def _close_stage(self) -> None:
        self.seconds[self._stage] = time.perf_counter() - self._stage_started
