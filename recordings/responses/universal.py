"""Universal files: data set 58 (frequency responses and coherences), 55 (modes), 15 and 2411 (nodes), 164 (units)."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from recordings.convert.uff import load_sets
from recordings.convert.uff_fields import AXES
from recordings.errors import InputError
from recordings.quantities import QUANTITIES
from recordings.responses.found import End, FoundModes, FoundResponse, Responses, Vector, checked
from recordings.responses.units import factor_of_label, factor_of_labels

FREQUENCY_RESPONSE, COHERENCE = 4, 6
"""Function types of data set 58."""
COMPLEX = (5, 6)
FORCES = (9, 13)
"""Specific data types of forces: reaction and excitation."""
BLANK = ("", "none")
NORMAL_MODE, COMPLEX_MODES = 2, (3, 7)
"""Analysis types of data set 55."""
AVERAGES = re.compile(r"averages?\s*[=:]\s*(\d{1,7})", re.IGNORECASE)


def read_universal(path: Path) -> Responses:
    """Read what a universal file has of responses, modes and nodes.

    Raises
    ------
    InputError
        With the data set, if it is no universal file or a set is damaged or in units that nobody knows.
    """
    _, sets = load_sets(path, kinds=(15, 55, 58, 164, 2411))
    length, force = 1.0, 1.0
    nodes: dict[int, Vector] = {}
    found: list[FoundResponse] = []
    coherence: dict[tuple[object, ...], Any] = {}
    modes: list[FoundModes] = []
    for number, fields in enumerate(sets, start=1):
        place, kind = f"data set {number}", fields["type"]
        try:
            if kind == 164:
                length, force = 1 / float(fields["length"]), 1 / float(fields["force"])
            elif kind in (15, 2411):
                points = zip(*(np.asarray(fields[axis], float) * length for axis in "xyz"), strict=True)
                nodes |= {
                    int(n): (float(x), float(y), float(z))
                    for n, (x, y, z) in zip(fields["node_nums"], points, strict=True)
                }
            elif kind == 55:
                modes += _mode(fields)
            elif kind == 58 and fields["func_type"] == FREQUENCY_RESPONSE:
                found.append(_response(path, place, fields, length, force))
            elif kind == 58 and fields["func_type"] == COHERENCE:
                coherence[_ends(fields)] = np.asarray(fields["data"]).real
        except (ValueError, KeyError, ZeroDivisionError, OverflowError) as error:
            raise InputError(path, place, str(error) or "is damaged") from error
    own = [one for one in sets if one["type"] == 58 and one["func_type"] == FREQUENCY_RESPONSE]
    with_noise = [_with_coherence(path, one, fields, coherence) for one, fields in zip(found, own, strict=True)]
    return Responses(path=str(path), responses=tuple(with_noise), modes=tuple(modes), nodes=nodes)


def _ends(fields: Mapping[str, Any]) -> tuple[object, ...]:
    """What a response and its coherence share."""
    return (*(int(fields[name]) for name in ("rsp_node", "rsp_dir", "ref_node", "ref_dir")), fields["rsp_ent_name"])


def _response(path: Path, place: str, fields: dict[str, Any], length: float, force: float) -> FoundResponse:
    if fields["ord_data_type"] not in COMPLEX:
        raise ValueError("a frequency response without phase; export it as complex values")
    quantity, factor = _units(fields, length, force)
    x, H, _ = checked(
        path, place, frequency_Hz=fields["x"], H=np.asarray(fields["data"], complex) * factor, coherence=None
    )
    texts = " ".join(str(fields[f"id{n}"]) for n in range(1, 6))
    averages = AVERAGES.search(texts)
    names = [_name(fields[key]) for key in ("rsp_ent_name", "ref_ent_name")]
    ends = [
        End(name, int(fields[f"{end}_node"]), AXES.get(int(fields[f"{end}_dir"]), ""))
        for name, end in zip(names, ("rsp", "ref"), strict=True)
    ]
    return FoundResponse(
        place=place, response=ends[0], reference=ends[1], quantity=quantity, frequency_Hz=x, H=H,
        averages=int(averages[1]) if averages else 0,
    )  # fmt: skip


def _name(text: str) -> str:
    return "" if text.strip().lower() in BLANK else text.strip()


def _units(fields: Mapping[str, Any], length: float, force: float) -> tuple[str, float]:
    """From the labels of the two units, or of one as a quotient; else from type codes and the file's own units."""
    above, below = (_name(str(fields[f"{axis}_axis_units_lab"])) for axis in ("ordinate", "orddenom"))
    if above:
        return factor_of_labels(above, below) if below else factor_of_label(above)
    code, drive = int(fields["ordinate_spec_data_type"]), int(fields["orddenom_spec_data_type"])
    motion = next((one.name for one in QUANTITIES if one.reads == "displacement" and one.uff == code), None)
    if motion is None or drive not in FORCES:
        raise ValueError(
            f"its type codes, {code} over {drive}, are no displacement, velocity or acceleration per force; "
            "label its units, (m/s^2) and N"
        )
    return motion, length / force


def _with_coherence(
    path: Path, one: FoundResponse, fields: Mapping[str, Any], coherence: Mapping[tuple[object, ...], Any]
) -> FoundResponse:
    known = coherence.get(_ends(fields))
    if known is None:
        return one
    _, _, own = checked(path, one.place, frequency_Hz=fields["x"], H=np.asarray(fields["data"]), coherence=known)
    return FoundResponse(**{**vars(one), "coherence": own})


def _mode(fields: Mapping[str, Any]) -> list[FoundModes]:
    """A mode; nothing for what else data set 55 may hold."""
    kind = fields["analysis_type"]
    if kind == NORMAL_MODE:
        frequency, damping = float(fields["freq"]), float(fields["modal_damp_vis"])
    elif kind in COMPLEX_MODES:
        pole = complex(fields["eig"])
        frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole) if pole else 0.0
    else:
        return []
    if not (np.isfinite(frequency) and frequency >= 0):
        raise ValueError("a mode's frequency is no number")
    shape = np.stack([np.asarray(fields[f"r{axis}"], complex) for axis in (1, 2, 3)], axis=1)
    nodes = np.asarray(fields["node_nums"], np.int64)
    return [FoundModes(frequency_Hz=frequency, damping_ratio=damping, nodes=nodes, shape=shape)]
