"""A run shown as it happens, by a process of its own that the acquisition never waits for.

The acquisition lays what it has into a queue of bounded length and goes on; the other process draws.  While a viewer is
slow or stands still, rerun holds that process up, the queue fills, and what finds no room in it is counted and left out
of the picture.  The recording has it all the same.
"""

import multiprocessing
import queue
from pathlib import Path

from recordings.run import Event, SampleBlock, Step
from twin.procedures import StepResult
from twin.views.live.about import LiveAbout
from twin.views.live.process import draw

ROOM_BLOCKS = 512
"""Blocks of samples that may wait to be drawn."""
START_S = 60.0
"""Patience with the other process when it starts."""
VIEWER_END_S, FILE_END_S = 5.0, 20.0
"""Patience for what still waits when the run ends: a viewer may stand still for good, a file does not."""


class LiveView:
    """Hands a run over to a process that draws it; nothing here waits once the run goes.

    RuntimeError if the process does not start.

    Parameters
    ----------
    to
        The address of a viewer, ``rerun+http://HOST:PORT/proxy``, or the .rrd file to write.
    """

    def __init__(self, about: LiveAbout, to: str | Path) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would share the instruments' descriptors
        self._queue = context.Queue(4096)  # blocks give way first, so that steps and events find room
        self._room = context.BoundedSemaphore(ROOM_BLOCKS)
        ready = context.Event()
        self._process = context.Process(
            target=draw, args=(self._queue, self._room, ready, about, to), name="live view", daemon=True
        )
        self._process.start()
        self._patience_s = FILE_END_S if isinstance(to, Path) else VIEWER_END_S
        self.not_shown = 0
        """Blocks, steps and events that found no room."""
        waited = 0.0
        while not ready.wait(0.2):
            waited += 0.2
            if waited > START_S or not self._process.is_alive():
                self._process.kill()
                raise RuntimeError("the process that draws the live view did not start")

    def show(self, what: SampleBlock | Step | StepResult | Event, time_ns: int = 0) -> None:
        """Show samples, that a step's state begins, a measured step, or what happened; `time_ns` is when."""
        if isinstance(what, SampleBlock) and not self._room.acquire(block=False):
            self.not_shown += 1
        else:
            self._offer(what, time_ns)

    def close(self) -> bool:
        """End the view; whether all that was handed over has been drawn."""
        self._offer(None)
        self._process.join(self._patience_s)
        drawn = self._process.exitcode == 0
        if self._process.is_alive():
            # Not asked to end but made to: a stopped viewer holds the process up where no signal's handler would run.
            self._process.kill()
            self._process.join(VIEWER_END_S)
        self._queue.cancel_join_thread()
        self._queue.close()
        return drawn

    def _offer(self, what: object, time_ns: int = 0) -> None:
        try:
            self._queue.put_nowait((self.not_shown, time_ns, what))
        except queue.Full:
            self.not_shown += 1
            if isinstance(what, SampleBlock):
                self._room.release()
