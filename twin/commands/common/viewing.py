"""The options by which a command shows its run as it happens, and what stands between the run and the view."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from recordings.errors import InputError, blamed_on
from recordings.run import Event, SampleBlock, Step
from recordings.streams import Acquisition
from recordings.whole import check_writable
from twin.commands.common.options import FILE
from twin.commands.common.output import console, say

if TYPE_CHECKING:
    from twin.procedures import Procedure, RunSink, StepResult
    from twin.rigs import Rig
    from twin.views.live.about import LiveAbout
    from twin.views.live.view import LiveView


def view_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--view``, ``--view-to`` and ``--save-view`` to a command, as the argument `watch`."""

    @wraps(function)
    def gathered(*arguments: Any, view: bool, view_to: str | None, save_view: Path | None, **others: Any) -> Any:
        return function(*arguments, watch=WatchOptions(view, view_to, save_view), **others)

    for option in (
        click.option("--save-view", type=FILE, metavar="FILE.rrd", help="Keep the live view in a file."),
        click.option("--view-to", metavar="HOST:PORT", help="Show the run as it happens in a rerun viewer that runs."),
        click.option("--view", is_flag=True, help="Show the run as it happens, in a viewer of its own on loopback."),
    ):
        gathered = option(gathered)
    return gathered


@dataclass(frozen=True)
class WatchOptions:
    """Where a run is to be shown."""

    view: bool = False
    view_to: str | None = None
    save_view: Path | None = None

    @property
    def wanted(self) -> bool:
        """Whether anywhere."""
        return self.view or self.view_to is not None or self.save_view is not None

    def check(self, *, overwrite: bool) -> None:
        """Find out what can be wrong, before anything moves; `overwrite` is whether the file may be replaced.

        InputError if there is no display, no viewer at the address, no such folder for the file, or a file already.
        """
        if not self.wanted:
            return
        from twin.views.rerun.viewer import viewer_url, why_no_window

        if self.view and self.view_to is not None:
            raise InputError("--view", "", "goes not with --view-to", "leave one of them out")
        if self.view and (why := why_no_window()):
            advice = "send to a viewer elsewhere with --view-to, or keep the view with --save-view FILE.rrd"
            raise InputError("--view", "", why, advice)
        if self.view_to is not None:
            viewer_url(self.view_to)
        if self.save_view is not None:
            if self.save_view.suffix.lower() != ".rrd":
                raise InputError("--save-view", "", f"{self.save_view} must end in .rrd")
            check_writable(self.save_view, overwrite=overwrite)


class Watch:
    """Looks over a run's shoulder and tells all live views; does nothing where there is none."""

    def __init__(self, views: Sequence[LiveView]) -> None:
        self._views = views
        self._latest_ns = 0

    @property
    def not_shown(self) -> int:
        """What found no room in the fullest view."""
        return max((view.not_shown for view in self._views), default=0)

    def acquisition(self, acquisition: Acquisition) -> Acquisition:
        """The same acquisition, its blocks shown."""
        return cast(Acquisition, _WatchedAcquisition(acquisition, self)) if self._views else acquisition

    def sink(self, sink: RunSink) -> RunSink:
        """The same sink, its steps and events shown."""
        return cast("RunSink", _WatchedSink(sink, self)) if self._views else sink

    def both(self, acquisition: Acquisition, sink: RunSink) -> tuple[Acquisition, RunSink]:
        """Acquisition and sink, as a rehearsal takes them."""
        return self.acquisition(acquisition), self.sink(sink)

    def block(self, block: SampleBlock) -> None:
        """Show samples."""
        self._latest_ns = max(self._latest_ns, block.time_ns + round(len(block) * 1e9 / block.sample_rate_Hz))
        for view in self._views:
            view.block(block)

    # The file's time may leave out the waits: what happens is shown at the time of the latest samples instead.
    def step(self, step: Step) -> None:
        """Show that a step's state begins."""
        for view in self._views:
            view.step(self._latest_ns, step)

    def event(self, event: Event) -> None:
        """Show what happened."""
        for view in self._views:
            view.event(self._latest_ns, event)

    def result(self, result: StepResult) -> None:
        """Show a measured step."""
        for view in self._views:
            view.result(self._latest_ns, result)


@contextmanager
def watched(options: WatchOptions, about: LiveAbout) -> Iterator[Watch]:
    """The live views that are wanted, while the block runs."""
    if not options.wanted:
        yield Watch([])
        return
    with console.status("starting the live view"):
        views = _open(options, about)
    watch = Watch(views)
    try:
        yield watch
    finally:
        drawn = [view.close() for view in views]
        if watch.not_shown:
            say(f"live view: {watch.not_shown} blocks or steps were not shown; the recording has them")
        if not all(drawn):
            say("live view: the viewer stood still or was gone at the end; the recording is whole")
        elif options.save_view is not None:
            say(f"{options.save_view}: the live view")


def _open(options: WatchOptions, about: LiveAbout) -> list[LiveView]:
    from twin.views.live.view import LiveView
    from twin.views.rerun.viewer import open_viewer, viewer_url

    targets: list[str | Path] = []
    with blamed_on("--view", of=RuntimeError):
        if options.view:
            targets.append(open_viewer("--memory-limit", "25%", "--server-memory-limit", "256MiB").url)
        if options.view_to is not None:
            targets.append(viewer_url(options.view_to))
        if options.save_view is not None:
            targets.append(options.save_view)
        return [LiveView(about, target) for target in targets]


def known_branches(rig: Rig, preload: str | None, procedure: Procedure) -> list[dict[str, Any]]:
    """Predicted curves of a force-controlled sweep, with a word on each that ends early."""
    from twin.rehearsal import branch_tables

    branches = branch_tables(rig, preload=preload, procedure=procedure)
    for branch in branches:
        if branch["ends_early"]:
            say(f"the predicted branch at {branch['force_N']:g} N ends early, at {branch['ends_early']}")
    return branches


class _Watched:
    """Hands on whatever is asked of it to what it stands before; subclasses show what passes."""

    def __init__(self, inner: Any, watch: Watch) -> None:
        self._inner, self._watch = inner, watch

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


class _WatchedAcquisition(_Watched):
    """An acquisition whose blocks are shown as they are read."""

    def read(self, *, timeout_s: float = 2.0) -> Sequence[SampleBlock]:
        blocks: Sequence[SampleBlock] = self._inner.read(timeout_s=timeout_s)
        for block in blocks:
            self._watch.block(block)
        return blocks


class _WatchedSink(_Watched):
    """A sink whose steps and events are shown as they are written."""

    def write_step(self, step: Step) -> None:
        self._inner.write_step(step)
        self._watch.step(step)

    def write_event(self, event: Event) -> None:
        self._inner.write_event(event)
        self._watch.event(event)
