"""HDF5 files, and with them MATLAB's of version 7.3: every data set of numbers is a column, or several."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from recordings.errors import InputError
from recordings.importing.extras import extra
from recordings.importing.labels import split_label
from recordings.importing.signals import Signal, check_size, columns_of

if TYPE_CHECKING:
    import h5py

RATES = ("sample_rate_hz", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency", "fs", "rate")
"""Names, in small letters, of attributes and single numbers that say the sample rate, Hz."""
_UNITS = ("unit", "units", "Unit", "Units", "unit_string")
_MARK = b"\x89HDF\r\n\x1a\n"
MOST_SETS = 10_000


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5; MATLAB writes a head of its own before it."""
    with path.open("rb") as stream:
        start = stream.read(520)
    return _MARK in (start[:8], start[512:])


def read_hierarchical(path: Path) -> list[Signal]:
    """Columns of an HDF5 file; those of one group and length are one table.

    Raises
    ------
    InputError
        If h5py is missing, or the file is damaged or claims too much.
    """
    h5py = extra("h5py", path)
    try:
        with h5py.File(path, "r") as file:
            sets = list(_data_sets(file, h5py))
            check_size(path, "", sum(each.size for each in sets))
            rate = _rate(file.attrs) or next((_rate({_last(each): each[()]}) for each in sets if each.size == 1), None)
            return [signal for each in sets if each.size > 1 for signal in _signals(path, each, rate)]
    except InputError:
        raise
    except Exception as error:  # h5py lets through whatever a broken file provokes
        raise InputError(path, "", f"cannot be read as HDF5: {str(error)[:120]}") from error


def _data_sets(file: h5py.File, h5py: Any) -> Iterator[h5py.Dataset]:
    """All data sets but those that are kept in other files; links are not followed."""
    found: list[h5py.Dataset] = []

    def keep(_: str, item: Any) -> bool | None:
        here = isinstance(item, h5py.Dataset) and item.dtype.kind in "iufV"
        if here and not item.is_virtual and not item.external:
            found.append(item)
        return True if len(found) > MOST_SETS else None

    file.visititems(keep)
    yield from found


def _last(item: h5py.Dataset) -> str:
    return str(item.name).rpartition("/")[2]


def _rate(attributes: Any) -> float | None:
    """A sample rate among attributes, Hz."""
    for name, value in attributes.items():
        number = np.asarray(value)
        if name.lower() in RATES and number.size == 1 and number.dtype.kind in "iuf" and number.item() > 0:
            return float(number.item())
    return None


def _signals(path: Path, item: h5py.Dataset, rate: float | None) -> Iterator[Signal]:
    own, unit = split_label(_last(item))
    unit = next((_text(item.attrs[name]) for name in _UNITS if name in item.attrs), unit)
    rate = _rate(item.attrs) or _rate(item.parent.attrs) or rate
    fields = item.dtype.names
    parts = [(field, item[field]) for field in fields] if fields else [(own, item[()])]
    for label, array in parts:
        name, found = split_label(label) if fields else (label, unit)
        for column, values in columns_of(name, np.squeeze(array)):
            check_size(path, column, 0)
            table = f"{item.parent.name}"
            yield Signal(name=column, unit=found, values=values, table=table, sample_rate_Hz=rate)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
