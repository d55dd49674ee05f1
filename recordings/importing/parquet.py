"""Parquet tables, as pandas, polars and pyarrow write them."""

from pathlib import Path

import numpy as np
import pyarrow
from pyarrow import parquet

from recordings.errors import InputError
from recordings.importing.labels import split_label
from recordings.importing.signals import Signal, check_size


def read_parquet(path: Path) -> list[Signal]:
    """Columns of numbers and times; a field's metadata ``unit`` goes before the unit in its name.

    Raises
    ------
    InputError
        If it is no Parquet file, or claims too much.
    """
    try:
        with parquet.ParquetFile(path, memory_map=False) as file:
            schema = file.schema_arrow
            check_size(path, "", file.metadata.num_rows * len(schema), len(schema))
            signals = [_signal(field, file.read([field.name]).column(0)) for field in schema if _is_read(field.type)]
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        raise InputError(path, "", f"cannot be read as Parquet: {str(error)[:120]}") from error
    return signals


def _is_read(kind: pyarrow.DataType) -> bool:
    types = pyarrow.types
    return bool(types.is_floating(kind) or types.is_integer(kind) or types.is_timestamp(kind))


def _signal(field: pyarrow.Field, column: pyarrow.ChunkedArray) -> Signal:
    name, unit = split_label(field.name)
    said = field.metadata or {}
    unit = next((said[key].decode("utf-8", "replace") for key in (b"unit", b"units") if key in said), unit)
    if pyarrow.types.is_timestamp(field.type):
        return Signal(name=name, values=column.to_numpy().astype("datetime64[ns]"), table="")
    values = np.asarray(column.cast("float64").to_numpy(), dtype=np.float64)
    return Signal(name=name, unit=unit, values=values, table="")
