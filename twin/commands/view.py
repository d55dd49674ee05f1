"""`twin view`: a run, a rehearsal or a diagnosis in rerun."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from recordings.beside import temporary_folder
from recordings.errors import InputError, blamed_on
from recordings.whole import check_writable, whole_files
from twin.commands.common.options import FILE, json_option, overwrite_option
from twin.commands.common.output import console, print_json, say, working

RESULT = "result.json"


@click.command(name="view")
@click.argument("what", metavar="RUN|DIR", type=FILE)
@click.option("--save", type=FILE, metavar="FILE.rrd", help="Write the view and open nothing.")
@click.option(
    "--picture", type=FILE, metavar="FILE.png",
    help="Write a picture of the view, 1920 x 1080, and open nothing; needs no screen.",
)  # fmt: skip
@overwrite_option
@json_option
def command(what: Path, save: Path | None, picture: Path | None, overwrite: bool, as_json: bool) -> None:
    """Show RUN, an .mcap or a table (.csv), or DIR, where `twin demo`, `diagnose` or `rehearse` left its results.

    The viewer listens on this machine's loopback alone.
    """
    if save is not None and save.suffix.lower() != ".rrd":
        raise click.UsageError(f"--save: {save} must end in .rrd")
    if picture is not None and picture.suffix.lower() != ".png":
        raise click.UsageError(f"--picture: {picture} must end in .png")
    if not what.exists():
        raise InputError(what, "", "no such file or folder")
    check_writable(save, picture, overwrite=overwrite)
    told: dict[str, Any] = {"opened": False}
    with temporary_folder("twin-view") as made, whole_files(save, picture) as (saved, drawn):
        view = _save(what, saved or made / f"{what.resolve().stem or 'view'}.rrd")
        told |= {"view": save, "bytes": view.stat().st_size}
        if drawn is not None:
            _draw(view, drawn)
            told["picture"] = picture
        elif save is None:  # it stays for the viewer, or for who is told where it is
            told["view"] = view.rename(Path(tempfile.mkdtemp(prefix="twin-view-")) / view.name)
            told["opened"] = _open(told["view"])
    if as_json:
        print_json(told)
        return
    if save is not None:
        say(f"{save}: written; open it with 'rerun {save}'")
    if picture is not None:
        say(f"{picture}: written")


def _draw(view: Path, picture: Path) -> None:
    """A picture of a view by a viewer without a screen."""
    from twin.views.rerun.viewer import headless_viewer, save_picture

    advice = "a graphics driver is needed, in software too: Debian's mesa-vulkan-drivers"
    drawing = blamed_on("--picture", "", advice, of=RuntimeError)
    with drawing, console.status("drawing, without a screen"), headless_viewer(file=view) as viewer:
        save_picture(viewer, picture)


def _save(what: Path, out: Path) -> Path:
    """Write the view of `what` to `out`: the one a diagnosis left, or a new one from its recordings."""
    if what.is_file():
        return _save_run(what, out, None)
    left = sorted(what.glob("*.rrd"))
    if (result := what / RESULT).is_file():
        table = _read_result(result)
        recording = table.get("recording")
        if isinstance(recording, str) and "steps" in table:
            return _save_run(_inside(what, recording, result), out, table)
    if left:
        # view.rrd or run.rrd, as the commands call it
        return Path(shutil.copyfile(next((path for path in left if path.stem == "view"), left[0]), out))
    recorded = sorted(what.glob("*.mcap"))
    if len(recorded) == 1:
        return _save_run(recorded[0], out, None)
    if recorded:
        names = ", ".join(path.name for path in recorded[:6])
        raise InputError(what, "", "holds several recordings and no view", f"name one of them: {names}")
    raise InputError(what, "", "holds neither a view nor a recording", "give an .mcap, or a folder of results")


def _save_run(recording: Path, out: Path, rehearsal: Mapping[str, Any] | None) -> Path:
    from recordings import read_run
    from recordings.tables import read_table
    from twin.views.rerun.run import save_run
    from twin.views.rerun.table import save_table

    if recording.suffix.lower() == ".rrd":
        return Path(shutil.copyfile(recording, out))
    if recording.suffix.lower() == ".csv":
        save_table(read_table(recording), out)
        return out
    with working(f"reading {recording.name}") as begin:
        run = read_run(recording)
        begin("reducing and drawing")
        save_run(run, out, rehearsal=rehearsal)
    return out


def _read_result(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > 200_000_000:  # bytes
            raise InputError(path, "", "too large for a result of this program")
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(path, "", f"not a result of this program: {error}") from error
    if not isinstance(table, dict):
        raise InputError(path, "", "not a result of this program: no JSON object")
    return table


def _inside(folder: Path, name: str, source: Path) -> Path:
    """A file of the folder that a result names; names that lead elsewhere are refused."""
    path = folder / name
    if Path(name).name != name or not path.is_file():
        raise InputError(source, "recording", f"{name!r:.80} is not a file of {folder}")
    return path


def _open(view: Path) -> bool:
    """Open the viewer if there is a display; say how to open it elsewhere if not."""
    from twin.views.rerun.viewer import open_viewer, why_no_window

    if why := why_no_window():
        say(f"{why}; the view is {view}: open it with 'rerun {view.name}' where there is a screen")
        return False
    try:
        open_viewer(file=view)
    except RuntimeError as error:
        say(f"{error}; the view is {view}")
        return False
    say(f"opened {view}")
    return True
