"""The options by which a command shows its run as it happens, and what stands between the run and the view."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

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


Watched = TypeVar("Watched")


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

    def over(self, inner: Watched) -> Watched:
        """The same acquisition or sink, its blocks, steps and events shown."""
        return cast(Watched, _Watched(inner, self.show)) if self._views else inner

    def both(self, acquisition: Acquisition, sink: RunSink) -> tuple[Acquisition, RunSink]:
        """Acquisition and sink, as a rehearsal takes them."""
        return self.over(acquisition), self.over(sink)

    def show(self, what: SampleBlock | Step | StepResult | Event) -> None:
        """Show samples, that a step's state begins, a measured step, or what happened."""
        if isinstance(what, SampleBlock):
            self._latest_ns = max(self._latest_ns, what.end_ns)
        for view in self._views:
            # The file's time may leave out the waits: what happens is shown at the time of the latest samples instead.
            view.show(what, self._latest_ns)


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
    """An acquisition, or a sink, that hands on whatever is asked of it and shows what passes."""

    def __init__(self, inner: Any, show: Callable[[Any], None]) -> None:
        self._inner, self._show = inner, show

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def read(self, **options: Any) -> Sequence[SampleBlock]:
        blocks: Sequence[SampleBlock] = self._inner.read(**options)
        for block in blocks:
            self._show(block)
        return blocks

    def write_step(self, step: Step) -> None:
        self._inner.write_step(step)
        self._show(step)

    def write_event(self, event: Event) -> None:
        self._inner.write_event(event)
        self._show(event)
