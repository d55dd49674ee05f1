"""Tables of natural frequencies as measurements, one for each condition of the joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.diagnose.tables.limits import LIMITS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Measurement:
    """Natural frequencies of one condition, such as a preload.

    Attributes
    ----------
    number : ndarray of int, (m,)
        Bending modes, from 1.
    frequency_Hz, relative_std : ndarray, (m,)
    stated : bool
        Whether the table gave the standard deviations.
    """

    path: str
    condition: str
    number: NDArray[np.int64]
    frequency_Hz: Array
    relative_std: Array
    stated: bool

    def select(self, keep: NDArray[np.bool_]) -> Measurement:
        """Some of the frequencies."""
        return Measurement(
            self.path, self.condition, self.number[keep], self.frequency_Hz[keep], self.relative_std[keep], self.stated
        )


def read_frequencies(
    tables: Sequence[FrequencyTable],
    conditions: Mapping[str, object] | Sequence[str],
    *,
    named: Sequence[str] = (),
    default: str,
    source: str,
) -> list[Measurement]:
    """Sort tables by condition.

    Parameters
    ----------
    named
        Conditions given beside the tables: none, one for all, or one for each table.
    default
        Condition of a table that neither names one nor is named one.

    Raises
    ------
    InputError
        If a condition is not the rig's, is given twice, or contradicts the table's own column.
    """
    if len(named) not in (0, 1, len(tables)):
        raise InputError(
            "--preload",
            "",
            f"is given {len(named)} times for {len(tables)} tables",
            "give it once, or once for each table",
        )
    found: dict[str, Measurement] = {}
    for i, table in enumerate(tables):
        given = named[0] if len(named) == 1 else named[i] if named else None
        states = np.array([state or given or default for state in table.preload])
        if given is not None and (wrong := next((state for state in states if state != given), None)):
            raise InputError("--preload", "", f"is {given}, {table.path} holds {wrong}", "leave the option out")
        for state in dict.fromkeys(states.tolist()):
            rows = states == state
            if state not in conditions:
                place = f"line {table.line[rows][0]}, column preload" if any(table.preload) else ""
                where = table.path if any(table.preload) else "--preload"
                raise InputError(where, place, f"{source} has no preload {state}", f"it has {', '.join(conditions)}")
            if state in found:
                raise InputError(
                    table.path,
                    "",
                    f"{state} is in {found[state].path} already",
                    "name the preloads, --preload once a table",
                )
            found[state] = _measurement(table, state, rows)
    return list(found.values())


def _measurement(table: FrequencyTable, state: str, rows: NDArray[np.bool_]) -> Measurement:
    order = np.flatnonzero(rows)[np.argsort(table.mode[rows])]
    f, std = table.frequency_Hz[order], table.std_Hz[order]
    if np.any(std == 0):
        line = int(table.line[order][np.argmax(std == 0)])
        raise InputError(
            table.path, f"line {line}, column std_Hz", "is zero", "leave the column out if it is not known"
        )
    if np.any(np.diff(f) <= 0):
        line = int(table.line[order][1 + np.argmax(np.diff(f) <= 0)])
        raise InputError(table.path, f"line {line}, column frequency_Hz", "does not rise with the number of the mode")
    stated = bool(np.all(np.isfinite(std)))
    relative = np.hypot(std / f, LIMITS.model_std) if stated else np.full(len(f), LIMITS.assumed_std)
    return Measurement(table.path, state, table.mode[order], f, relative, stated)
