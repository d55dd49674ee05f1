"""Frequency responses as universal files: data set 58, function type 4, with the coherence as function type 6."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

from recordings.directions import axis_number
from recordings.quantities import quantity
from recordings.run import Channel, Run
from recordings.whole import refuse_existing, whole_file
from twin.exchange.responses import FrequencyResponses

_TEXT = 80


def write_universal(
    responses: Sequence[FrequencyResponses], path: str | Path, *, run: Run, overwrite: bool = False
) -> None:
    """Write frequency responses to a universal file, which appears whole or not at all.

    Nodes are the places of the run's channels in their order, from 1; directions are the nearest axes.  Values are in
    SI units, in binary with double precision.

    Raises
    ------
    InputError
        If the file exists, or cannot be written.
    """
    path = Path(path)
    refuse_existing(path, overwrite=overwrite)
    nodes = {name: node for node, name in enumerate(run.channels, start=1)}
    sets = [one for each in responses for one in _sets(each, nodes, run)]
    with whole_file(path) as part, warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves its file to be closed by Python
        pyuff.UFF(str(part)).write_sets(sets, mode="add")


# In data set 58 function 4 is a frequency response and 6 a coherence; 18 as a data type is a frequency.


def _sets(each: FrequencyResponses, nodes: dict[str, int], run: Run) -> list[dict[str, Any]]:
    found = []
    for row, channel in enumerate(each.responses):
        head = _head(each, channel, nodes, run)
        found.append({**head, **_axes(channel, each.force), "data": each.frf[row]})
        if each.coherence is not None:
            none = {"ordinate_spec_data_type": 0, "ordinate_axis_lab": "coherence", "orddenom_spec_data_type": 0}
            found.append({**head, **none, "func_type": 6, "data": each.coherence[row]})
    return found


def _head(each: FrequencyResponses, channel: Channel, nodes: dict[str, int], run: Run) -> dict[str, Any]:
    """What an FRF and its coherence share."""
    steps = np.diff(each.frequency_Hz)
    return {
        "type": 58, "binary": 1, "func_type": 4,
        "id1": f"{channel.name} / {each.force.name}"[:_TEXT], "id2": f"sweep {each.sweep}"[:_TEXT],
        "id3": run.info.get("started", "NONE")[:_TEXT], "id4": (run.info.get("rig") or "NONE")[:_TEXT],
        "id5": f"averages = {each.averages}" if each.averages else "NONE",
        "rsp_ent_name": _short(channel), "rsp_node": nodes[channel.name], "rsp_dir": axis_number(channel.direction),
        "ref_ent_name": _short(each.force), "ref_node": nodes[each.force.name],
        "ref_dir": axis_number(each.force.direction),
        "abscissa_spacing": int(np.allclose(steps, steps[0], rtol=1e-9)), "abscissa_spec_data_type": 18,
        "abscissa_axis_lab": "frequency", "abscissa_axis_units_lab": "Hz", "x": each.frequency_Hz,
    }  # fmt: skip


def _axes(channel: Channel, force: Channel) -> dict[str, Any]:
    return {
        "ordinate_spec_data_type": quantity(channel.quantity).uff, "ordinate_axis_lab": channel.quantity,
        "ordinate_axis_units_lab": channel.unit, "orddenom_spec_data_type": quantity(force.quantity).uff,
        "orddenom_axis_lab": force.quantity, "orddenom_axis_units_lab": force.unit,
    }  # fmt: skip


def _short(channel: Channel) -> str:
    return channel.name.encode("ascii", "replace")[:10].decode()
