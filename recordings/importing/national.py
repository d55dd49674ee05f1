"""TDMS files of National Instruments' programs."""

import logging
from pathlib import Path
from typing import Any

import numpy as np

from recordings.errors import InputError
from recordings.importing.extras import extra
from recordings.importing.labels import split_label
from recordings.importing.signals import Signal, check_size
from recordings.reader import open_input


def read_tdms(path: Path) -> list[Signal]:
    """Channels of numbers, each group a table; rate and start are those of the waveform's properties.

    Raises
    ------
    InputError
        If nptdms is missing, or the file is damaged or claims too much.
    """
    nptdms = extra("nptdms", path)
    extra("nptdms.log", path).log_manager.set_level(logging.CRITICAL)  # what it warns of is refused here
    size = path.stat().st_size
    try:
        with open_input(path) as stream, nptdms.TdmsFile.open(stream) as file:
            if file.file_status.incomplete_final_segment:
                raise InputError(path, "", "ends within its last segment: it is cut", "copy it again")
            channels = [channel for group in file.groups() for channel in group.channels()]
            claimed = sum(len(channel) for channel in channels)
            if claimed > size:
                raise InputError(path, "", f"claims {claimed} values in {size} bytes", "it is damaged or cut")
            check_size(path, "", claimed)
            found = [_signal(channel) for channel in channels if len(channel) > 1]
    except InputError:
        raise
    except Exception as error:  # nptdms lets through whatever a broken file provokes
        raise InputError(path, "", f"cannot be read as TDMS: {str(error)[:120] or type(error).__name__}") from error
    return [each for each in found if each is not None]


def _signal(channel: Any) -> Signal | None:
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        return Signal(name=channel.name, values=values.astype("datetime64[ns]"), table=channel.group_name)
    if values.dtype.kind not in "iuf":
        return None
    name, unit = split_label(channel.name)
    properties = channel.properties
    unit = str(properties.get("unit_string") or properties.get("NI_UnitDescription") or unit)
    step_s, start = properties.get("wf_increment"), properties.get("wf_start_time")
    return Signal(
        name=name, unit=unit, values=values.astype(np.float64), table=channel.group_name,
        sample_rate_Hz=1 / float(step_s) if step_s else None,
        start_ns=int(np.datetime64(start, "ns").astype(np.int64)) if start is not None else None,
    )  # fmt: skip
