"""rerun's viewer, always on loopback: one to look at, one to send to, and one without a screen that takes pictures."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from recordings.errors import InputError, reason_of
from recordings.whole import whole_file

LOOPBACK = "127.0.0.1"
START_S = 60.0
_ADDRESS = re.compile(r"(?:rerun\+http://)?([\w.\-]+|\[[0-9a-fA-F:]+\]):(\d{1,5})(?:/proxy)?")

Answer = TypeVar("Answer")


@dataclass(frozen=True, kw_only=True)
class Viewer:
    """A viewer's process, and the address to send to."""

    process: subprocess.Popen[bytes]
    url: str


def why_no_window() -> str:
    """Why no viewer can be opened here; empty if one can."""
    if find_viewer() is None:
        return "the program 'rerun' is not installed"
    has_display = sys.platform in ("darwin", "win32") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
    return "" if has_display else "no display here"


def find_viewer() -> str | None:
    """The program ``rerun`` that belongs to this Python, or any."""
    beside = Path(sys.executable).with_name("rerun")
    return str(beside) if beside.exists() else shutil.which("rerun")


def viewer_url(address: str) -> str:
    """The URL of a running viewer from ``HOST:PORT`` or the URL itself.

    InputError if it is no address, or nobody listens there.
    """
    found = _ADDRESS.fullmatch(address)
    if found is None or not 0 < int(found[2]) < 65536:
        raise InputError(address, "", "is no viewer's address", "give HOST:PORT, such as 127.0.0.1:9876")
    host, port = found[1], int(found[2])
    try:
        with socket.create_connection((host.strip("[]"), port), timeout=3.0):
            pass
    except OSError as error:
        reason = f"no viewer listens there: {reason_of(error)}"
        raise InputError(address, "", reason, "start one: rerun --bind 127.0.0.1") from error
    return f"rerun+http://{host}:{port}/proxy"


def open_viewer(*options: str, file: Path | None = None) -> Viewer:
    """Start a viewer that listens on this machine's loopback alone, and wait until it does.

    RuntimeError if the program is not there, or does not come up.

    Parameters
    ----------
    options
        Further ones of the program ``rerun``.
    """
    program = find_viewer()
    if program is None:
        raise RuntimeError("the program 'rerun' is not installed")
    port = _free_port()
    # Its own process group: Ctrl-C in the terminal ends the run, not the picture of it; and it can be ended whole.
    process = subprocess.Popen(
        [program, "--bind", LOOPBACK, "--port", str(port), "--hide-welcome-screen", *options]
        + ([str(file)] if file else []),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    until = time.monotonic() + START_S
    while time.monotonic() < until and process.poll() is None:
        with socket.socket() as asked:
            asked.settimeout(0.5)
            if asked.connect_ex((LOOPBACK, port)) == 0:
                return Viewer(process=process, url=f"rerun+http://{LOOPBACK}:{port}/proxy")
        time.sleep(0.1)
    _end(process)
    raise RuntimeError("rerun's viewer did not start")


@contextmanager
def headless_viewer(*, file: Path | None = None) -> Iterator[Viewer]:
    """A viewer without a screen, ended with the block."""
    viewer = open_viewer("--headless", "--window-size", "1920x1080", file=file)
    try:
        yield viewer
    finally:
        _end(viewer.process)


def save_picture(viewer: Viewer, picture: Path, *, at: tuple[str, float] | None = None) -> None:
    """Write what a viewer shows as a PNG.

    RuntimeError if the viewer does not draw; InputError if `picture` cannot be written.

    Parameters
    ----------
    viewer
        With data loaded or coming.
    at
        Timeline and time, s, to show; where the viewer stands if left out.
    """
    from rerun.experimental import ViewerClient

    client = _patiently(viewer, lambda: ViewerClient.connect(viewer.url))

    def loaded() -> bool:
        state = client.get_state()
        return bool(state.views) and not state.loading

    while not _patiently(viewer, loaded):
        time.sleep(0.2)
    if at is not None:
        _patiently(viewer, lambda: client.set_time(at[0], duration=at[1], play_state="paused"))
    time.sleep(6.0)  # panes find their widths, curves are drawn, and the viewer's own messages go
    image: bytes = _patiently(viewer, client.take_screenshot)
    with whole_file(picture) as part:
        part.write_bytes(image)


def _patiently(viewer: Viewer, ask: Callable[[], Answer]) -> Answer:
    """Ask again while the viewer is too busy to answer in time."""
    until = time.monotonic() + 120.0  # without a graphics card, on a busy machine
    while True:
        try:
            return ask()
        except (OSError, RuntimeError) as error:
            if time.monotonic() > until or viewer.process.poll() is not None:
                raise RuntimeError(f"the viewer does not draw: {error}") from error
            time.sleep(0.3)


def _end(process: subprocess.Popen[Any]) -> None:
    """End a viewer and the launcher it was started by."""
    for ending in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, ending)
            process.wait(5.0)
        except ProcessLookupError:
            return
        except subprocess.TimeoutExpired:
            continue
        return


def _free_port() -> int:
    with socket.socket() as free:
        free.bind((LOOPBACK, 0))
        return int(free.getsockname()[1])
