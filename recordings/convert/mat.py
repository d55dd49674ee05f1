"""Runs as MATLAB 5 files: plain arrays and one text, nothing that needs more than ``load``.

``metadata`` is JSON text (``jsondecode`` it); for the device at place k (from 1) in its list ``devices``,
``samples_k`` has a column a channel in the order of its ``channels`` (single, SI units), ``number_k`` and
``time_ns_k`` (int64 columns) the number and the time of each row.  Samples that were lost have no row.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from recordings.convert.blocks import blocks_of, device_from_rows, to_float32
from recordings.convert.description import describe, parse_description
from recordings.convert.mat_structure import check_structure
from recordings.errors import InputError, blamed_on
from recordings.reader import open_input
from recordings.run import DeviceSamples, Run

SIZE_LIMIT_BYTES = 2 << 30
"""Of the file, and of what it holds after decompression; a MATLAB 5 variable cannot be larger."""
_CLASSES = {
    "char": 4, "single": 4, "double": 8, "logical": 1,
    **{f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)},
}  # fmt: skip


def write_mat(run: Run, path: Path) -> list[str]:
    """Write all of a run; nothing is left behind."""
    arrays: dict[str, Any] = {"metadata": json.dumps(describe(run))}
    for place, device in enumerate(run.devices.values(), start=1):
        blocks = list(blocks_of(device))
        rows = [np.arange(len(block)) for block in blocks]
        number = [row + block.first_index for row, block in zip(rows, blocks, strict=True)]
        period_ns = 1e9 / device.sample_rate_Hz
        time_ns = [b.time_ns + np.rint(row * period_ns).astype(np.int64) for row, b in zip(rows, blocks, strict=True)]
        samples = [np.stack(list(block.samples.values()), axis=1) for block in blocks]
        arrays[f"samples_{place}"] = np.concatenate(samples)
        arrays[f"number_{place}"] = np.concatenate(number).astype(np.int64)[:, None]
        arrays[f"time_ns_{place}"] = np.concatenate(time_ns)[:, None]
        if arrays[f"samples_{place}"].nbytes >= SIZE_LIMIT_BYTES:
            raise InputError(path, "", "a MATLAB 5 file cannot hold 2 GiB in one variable", "use .csv or .uff")
    with path.open("xb") as stream:
        scipy.io.savemat(stream, arrays, do_compression=True)
    return []


def read_mat(path: Path) -> Run:
    """Read a run that `write_mat` or another program wrote in this form.

    Raises
    ------
    InputError
        If it is not in this form, or larger than `SIZE_LIMIT_BYTES`.
    """
    arrays = load_arrays(path)
    try:
        text = arrays["metadata"]
        description = parse_description(json.loads("".join(np.atleast_1d(text).astype(str).ravel().tolist())))
    except KeyError:
        raise InputError(path, "", "has no variable 'metadata'") from None
    except (ValueError, RecursionError) as error:
        raise InputError(path, "metadata", str(error)[:200]) from error
    devices: dict[str, DeviceSamples] = {}
    for place, (name, (rate, channels, overload)) in enumerate(description.devices.items(), start=1):
        try:
            samples = np.asarray(arrays[f"samples_{place}"])
            number = np.asarray(arrays[f"number_{place}"]).ravel()
            time_ns = np.asarray(arrays[f"time_ns_{place}"]).ravel()
        except KeyError as error:
            raise InputError(path, "", f"has no variable {error}") from error
        if samples.shape != (len(number), len(channels)) or time_ns.shape != number.shape:
            raise InputError(path, f"samples_{place}", f"has the shape {samples.shape}, not (rows, channels)")
        if number.dtype.kind not in "iuf" or time_ns.dtype.kind not in "iuf" or samples.dtype.kind != "f":
            raise InputError(path, f"samples_{place}", "is not made of numbers")
        with np.errstate(invalid="ignore"):
            numbers, times = number.astype(np.int64), time_ns.astype(np.int64)
        with blamed_on(path, f"device {name!r:.80}"):
            columns = {each: to_float32(samples[:, at]) for at, each in enumerate(channels)}
            device = device_from_rows(name, rate, numbers, times, columns, overload)
        if device is not None:
            devices[name] = device
    return description.run(str(path), devices)


def load_arrays(path: Path) -> dict[str, Any]:
    """The variables of a file; only plain arrays are let through to scipy's reader."""
    with open_input(path) as stream:
        try:
            check_structure(stream, limit_bytes=SIZE_LIMIT_BYTES)
        except ValueError as error:
            raise InputError(path, "", f"cannot be read as a MATLAB 5 file: {error}") from error
        stream.seek(0)
        try:
            for name, shape, kind in scipy.io.whosmat(stream):
                if kind not in _CLASSES:
                    raise InputError(path, f"variable {name!r:.80}", f"is of class {kind}, which a run does not have")
                if int(np.prod(shape, dtype=object)) * _CLASSES[kind] > SIZE_LIMIT_BYTES:
                    raise InputError(path, f"variable {name!r:.80}", "claims more than the file can hold")
            stream.seek(0)
            return dict(scipy.io.loadmat(stream, chars_as_strings=True))
        except InputError:
            raise
        except Exception as error:  # scipy lets through whatever a broken file provokes
            raise InputError(path, "", f"not a MATLAB 5 file that scipy can read: {str(error)[:120]}") from error
