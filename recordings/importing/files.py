"""Which reader a foreign file has, by its suffix, and the columns of several files with names of their own."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from recordings.errors import InputError
from recordings.importing.hierarchical import read_hierarchical
from recordings.importing.mapping import Mapping
from recordings.importing.matlab import read_matlab
from recordings.importing.national import read_tdms
from recordings.importing.signals import Signal
from recordings.importing.sound import read_sound
from recordings.importing.universal import read_universal
from recordings.reader import open_input


def _read_parquet(path: Path) -> list[Signal]:
    from recordings.importing.parquet import read_parquet  # with pyarrow, 30 MB for tables alone

    return read_parquet(path)


READERS: dict[tuple[str, ...], Callable[[Path], list[Signal]]] = {
    (".mat",): read_matlab,
    (".h5", ".hdf5", ".hdf"): read_hierarchical,
    (".wav",): read_sound,
    (".tdms",): read_tdms,
    (".parquet", ".pq"): _read_parquet,
    (".uff", ".unv"): read_universal,
}
TEXTS = (".csv", ".txt", ".tsv", ".dat", ".asc")


def read_files(paths: Sequence[Path], mapping: Mapping) -> list[Signal]:
    """Columns of all files; those of two files or tables with one name get the file's or the table's before it.

    Raises
    ------
    InputError
        If a file is not there, of no known format, damaged, or without columns of numbers.
    """
    for path in paths:
        open_input(path).close()
    found: list[tuple[Path, Signal]] = []
    for path in paths:
        signals = _read(path, mapping)
        if not signals:
            raise InputError(path, "", "has no columns of numbers")
        found += [(path, each) for each in signals]
    names = Counter(each.name for _, each in found)
    named = [
        replace(
            each,
            table=f"{path.stem}/{each.table}",
            name=each.name
            if names[each.name] == 1
            else "/".join(filter(None, (path.stem, each.table.strip("/"), each.name))),
        )
        for path, each in found
    ]
    twice = [name for name, count in Counter(each.name for each in named).items() if count > 1]
    if twice:
        raise InputError(paths[0], f"column {twice[0]!r:.60}", "stands twice", "rename one of them")
    return named


def _read(path: Path, mapping: Mapping) -> list[Signal]:
    suffix = path.suffix.lower()
    if suffix in TEXTS:
        from recordings.importing.delimited import read_delimited  # with pyarrow, as Parquet's

        return read_delimited(path, mapping)
    reader = next((reader for suffixes, reader in READERS.items() if suffix in suffixes), None)
    if reader is None:
        if suffix == ".mcap":
            raise InputError(path, "", "is a recording already", "every command takes it as it is")
        known = ", ".join([*TEXTS, *(each for suffixes in READERS for each in suffixes)])
        raise InputError(path, "", f"no format has the suffix {suffix!r:.40}", f"there are {known}")
    return reader(path)
