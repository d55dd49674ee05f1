"""The process that draws a live view: takes what has come, draws it in one go, and takes again."""

import multiprocessing
import os
import queue
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import BoundedSemaphore, Event
from pathlib import Path
from typing import Any

import rerun as rr

from recordings.run import SampleBlock
from twin.views.live.about import LiveAbout
from twin.views.live.drawing import LiveDrawing
from twin.views.rerun.rrd import APPLICATION, recording_file

Item = tuple[int, int, Any]
"""How much was not shown until then, when it was, and what comes; None is the end."""


def draw(waiting: Any, room: BoundedSemaphore, ready: Event, about: LiveAbout, to: str | Path) -> None:
    """Draw what comes through a queue until its end is told, or whoever fills it is gone.

    Parameters
    ----------
    waiting
        Gives what comes, as :data:`Item`.
    room
        Released for every block of samples taken.
    ready
        Set when drawing can begin.
    about, to
        As for :class:`~twin.views.live.view.LiveView`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the run, and the run ends the view
    os.environ.setdefault("RUST_LOG", "error")  # that a viewer stands still is no news for the operator
    with recording_file(to) if isinstance(to, Path) else _connection(to) as recording:
        drawing = LiveDrawing(recording, about)
        ready.set()
        for items in _taken(waiting, room):
            drawing.draw(items)


@contextmanager
def _connection(url: str) -> Iterator[rr.RecordingStream]:
    recording = rr.RecordingStream(APPLICATION, send_properties=False)
    recording.connect_grpc(url)
    yield recording
    try:
        recording.flush(timeout_sec=3.0)  # seconds, for a viewer that does not take what is left
    except RuntimeError:  # the viewer stands still, or is gone
        os._exit(3)  # rerun would go on waiting in its own ending
    recording.disconnect()


def _taken(waiting: Any, room: BoundedSemaphore) -> Iterator[list[Item]]:
    """What comes within each short while, again and again."""
    parent = multiprocessing.parent_process()
    ended = False
    while not ended:
        items: list[Item] = []
        until = time.monotonic() + 0.1
        # Many blocks in one go cost little more than one
        while not ended and len(items) < 1024 and (left := until - time.monotonic()) > 0:
            try:
                item = waiting.get(timeout=left)
            except queue.Empty:
                ended = parent is not None and not parent.is_alive()
                continue
            if isinstance(item[-1], SampleBlock):
                room.release()
            if item[-1] is None:
                ended = True
            else:
                items.append(item)
        yield items
