"""MATLAB files: each array is a column or several; a single number named as a sample rate is one."""

from pathlib import Path

import numpy as np

from recordings.convert.mat import load_arrays
from recordings.errors import InputError
from recordings.importing.hierarchical import RATES, is_hdf5, read_hierarchical
from recordings.importing.labels import split_label
from recordings.importing.signals import Signal, check_size, columns_of
from recordings.reader import open_input


def read_matlab(path: Path) -> list[Signal]:
    """Columns of a MATLAB 5 or 7.3 file; arrays of one length are one table.

    Raises
    ------
    InputError
        If it is no such file of plain arrays.
    """
    open_input(path).close()
    if is_hdf5(path):
        return read_hierarchical(path)
    arrays = {name: np.asarray(array) for name, array in load_arrays(path).items() if not name.startswith("__")}
    if "metadata" in arrays and "samples_1" in arrays:
        raise InputError(path, "", "is a recording already", "'twin convert' reads it")
    check_size(path, "", sum(array.size for array in arrays.values()))
    rates = [float(array.item()) for name, array in arrays.items() if name.lower() in RATES and _is_number(array)]
    rate = next(iter(rates), None)
    return [
        Signal(name=column, unit=split_label(name)[1], values=values, table="", sample_rate_Hz=rate)
        for name, array in arrays.items()
        for column, values in columns_of(split_label(name)[0], np.squeeze(array))
    ]


def _is_number(array: np.ndarray) -> bool:
    return array.size == 1 and array.dtype.kind in "iuf" and array.item() > 0
