"""Which formats there are, and the way from one to another."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from recordings.convert.csv_samples import read_csv, write_csv
from recordings.convert.mat import read_mat, write_mat
from recordings.convert.mcap_run import write_mcap
from recordings.convert.uff import read_uff, write_uff
from recordings.errors import InputError
from recordings.reader import read_run
from recordings.run import Run
from recordings.whole import refuse_existing, whole_file


@dataclass(frozen=True, kw_only=True)
class Format:
    """A file format, known by its suffix."""

    suffix: str
    """With its dot, in lower case."""
    name: str
    """For people."""
    read: Callable[[Path], Run] | None
    """Gives the run that a file holds; raises InputError.  None if the format is only written."""
    write: Callable[[Run, Path], list[str]] | None
    """Writes a run to a path that does not exist and returns what it could not carry over, as sentences for people.
    None if the format is only read."""


FORMATS = (
    Format(suffix=".mcap", name="MCAP", read=read_run, write=write_mcap),
    Format(suffix=".uff", name="UFF58", read=read_uff, write=write_uff),
    Format(suffix=".unv", name="UFF58", read=read_uff, write=write_uff),
    Format(suffix=".csv", name="CSV", read=read_csv, write=write_csv),
    Format(suffix=".mat", name="MATLAB 5", read=read_mat, write=write_mat),
)


def convert(
    source: str | Path, target: str | Path, *, formats: Iterable[Format] = FORMATS, overwrite: bool = False
) -> list[str]:
    """Convert a recording from one format to another, both chosen by suffix.

    Parameters
    ----------
    source, target
        Files; `target` appears only when it is complete.
    formats
        Those to choose from.
    overwrite
        Replace an existing `target` instead of refusing.

    Returns
    -------
    list of str
        What could not be carried over, for people.

    Raises
    ------
    InputError
        If a suffix is not known, the source cannot be read, or the target exists or cannot be written.
    """
    source, target = Path(source), Path(target)
    known = {each.suffix: each for each in formats}
    reader, writer = _format(source, known), _format(target, known)
    if writer.write is None:
        raise InputError(target, "", f"{writer.name} can be read but not written")
    if reader.suffix == writer.suffix:
        raise InputError(target, "", "has the same format as the source", "there is nothing to convert")
    refuse_existing(target, overwrite=overwrite)
    run = read_as(source, formats=known.values())
    unread = [] if reader.read is read_run else [each.detail for each in run.events if each.kind == "not-converted"]
    with whole_file(target) as part:
        try:
            notes = writer.write(run, part)
        except InputError as error:
            if error.source == str(part):
                raise InputError(target, error.place, error.reason, error.remedy) from error
            raise
    return unread + notes


def read_as(source: str | Path, *, formats: Iterable[Format] = FORMATS) -> Run:
    """Read a run in any of `formats`, chosen by suffix.

    Raises
    ------
    InputError
        If the suffix is not known, or the file cannot be read.
    """
    source = Path(source)
    reader = _format(source, {each.suffix: each for each in formats})
    if reader.read is None:
        raise InputError(source, "", f"{reader.name} can be written but not read")
    return reader.read(source)


def _format(path: Path, known: dict[str, Format]) -> Format:
    found = known.get(path.suffix.lower())
    if found is None:
        raise InputError(path, "", f"no format has the suffix {path.suffix!r:.40}", f"there are {', '.join(known)}")
    return found
