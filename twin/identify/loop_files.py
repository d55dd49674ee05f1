"""Files of force-displacement loops: CSV in SI units, or the friction damper's tables in inches and kips."""

from pathlib import Path

import numpy as np

from recordings.columns import Columns
from recordings.errors import InputError
from twin.arrays import Array
from twin.identify.friction_loops import INCH, KIP, Loop, read_damper_json
from twin.identify.limits import LIMITS

COLUMNS = {"time_s": 1.0}, {"displacement_m": 1.0, "displacement_inch": INCH}, {"force_N": 1.0, "friction_kip": KIP}
FEWEST_ROWS = 100


def read_loop(path: Path) -> Loop:
    """A loop under its file's name.

    A CSV file has the columns ``time_s`` in equal steps, ``displacement_m`` (or ``displacement_inch``) and ``force_N``
    (or ``friction_kip``); other columns are ignored.  A JSON file is one of the ARTS laboratory's.

    InputError if the file is neither.
    """
    if path.suffix.lower() == ".json":
        return read_damper_json(path)
    table = Columns(path)
    if len(table) < FEWEST_ROWS:
        raise InputError(path, "", f"needs at least {FEWEST_ROWS} rows")
    time_s, displacement_m, force_N = (_column(table, known) for known in COLUMNS)
    step = np.diff(time_s)
    if step.mean() <= 0 or np.max(np.abs(step - step.mean())) > LIMITS.loop_files_uneven * step.mean():
        raise InputError(path, "column time_s", "does not rise in equal steps")
    return Loop(path.stem, float(1 / step.mean()), displacement_m, force_N)


def _column(table: Columns, known: dict[str, float]) -> Array:
    """The first of some columns that a table has, times its factor."""
    name = next((name for name in known if name in table.names), next(iter(known)))
    table.need(name)
    return known[name] * table.numbers(name)
