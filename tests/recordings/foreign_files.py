"""Files as other programs' own writers make them, of a few signals sampled together."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import scipy.io
from needed import package
from numpy.typing import NDArray

__all__ = ["WRITERS", "Signals", "fill_in"]

Signals = Mapping[str, tuple[str, NDArray[np.float32]]]
"""Unit and samples by name."""


def _frame(signals: Signals, rate_Hz: float) -> object:
    time = np.arange(len(next(iter(signals.values()))[1])) / rate_Hz
    columns = {f"{name} [{unit}]": values for name, (unit, values) in signals.items()}
    return package("pandas").DataFrame({"Time (s)": time, **columns})


def by_pandas(path: Path, signals: Signals, rate_Hz: float) -> None:
    with np.printoptions(legacy=False):  # as a program of its own: packages of other tests may set it for all
        _frame(signals, rate_Hz).to_csv(path, index=False)


def by_pandas_in_german(path: Path, signals: Signals, rate_Hz: float) -> None:
    with np.printoptions(legacy=False):
        _frame(signals, rate_Hz).to_csv(path, sep=";", decimal=",", encoding="cp1252", lineterminator="\r\n")


def by_numpy(path: Path, signals: Signals, rate_Hz: float) -> None:
    columns = [values for _, values in signals.values()]
    time = np.arange(len(columns[0])) / rate_Hz
    head = "t_s " + " ".join(f"{name}_{unit.replace('/s^2', '_per_s2')}" for name, (unit, _) in signals.items())
    np.savetxt(path, np.stack([time, *columns], axis=1), header=head)


def by_pyarrow(path: Path, signals: Signals, rate_Hz: float) -> None:
    frame = _frame(signals, rate_Hz)
    package("pyarrow.parquet").write_table(package("pyarrow").Table.from_pandas(frame), path)


def by_scipy(path: Path, signals: Signals, rate_Hz: float) -> None:
    named = {f"{name}_{unit.replace('/s^2', '_per_s2')}": values for name, (unit, values) in signals.items()}
    scipy.io.savemat(path, {"fs": rate_Hz, **named})


def by_h5py(path: Path, signals: Signals, rate_Hz: float) -> None:
    with package("h5py", "import").File(path, "w") as file:
        file.attrs["sample_rate"] = rate_Hz
        for name, (unit, values) in signals.items():
            file[f"data/{name}"] = values
            file[f"data/{name}"].attrs["units"] = unit


def by_nptdms(path: Path, signals: Signals, rate_Hz: float) -> None:
    nptdms = package("nptdms", "import")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([
            nptdms.ChannelObject("bench", name, values, properties={"wf_increment": 1 / rate_Hz, "unit_string": unit})
            for name, (unit, values) in signals.items()
        ])  # fmt: skip


def by_soundfile(path: Path, signals: Signals, rate_Hz: float) -> None:
    columns = np.stack([values for _, values in signals.values()], axis=1)
    package("soundfile").write(path, columns, int(rate_Hz), subtype="FLOAT")


def by_pyuff(path: Path, signals: Signals, rate_Hz: float) -> None:
    pyuff = package("pyuff")
    for node, (name, (unit, values)) in enumerate(signals.items(), start=1):
        time = np.arange(len(values)) / rate_Hz
        data_set = pyuff.prepare_58(
            binary=1, func_type=1, rsp_node=node, rsp_dir=2, ref_node=0, ref_dir=0, data=values.astype(float), x=time,
            abscissa_spacing=1, abscissa_inc=1 / rate_Hz, abscissa_min=0.0, num_pts=len(values), ord_data_type=4,
            rsp_ent_name=name, id1=name, id2="NONE", id3="NONE", id4="NONE", id5="NONE", abscissa_spec_data_type=17,
            ordinate_spec_data_type=13 if unit == "N" else 12, ordinate_axis_units_lab=unit, orddenom_spec_data_type=0,
        )  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # it leaves its file to be closed by Python
            pyuff.UFF(str(path)).write_sets(data_set, mode="add")


WRITERS: dict[str, Callable[[Path, Signals, float], None]] = {
    "pandas.csv": by_pandas,
    "german.csv": by_pandas_in_german,
    "numpy.txt": by_numpy,
    "pyarrow.parquet": by_pyarrow,
    "scipy.mat": by_scipy,
    "h5py.h5": by_h5py,
    "matlab73.mat": by_h5py,
    "nptdms.tdms": by_nptdms,
    "soundfile.wav": by_soundfile,
    "pyuff.uff": by_pyuff,
}
"""By the name of the file that is made."""


def fill_in(mapping: Path, signals: Signals) -> None:
    """Give the columns of a mapping that was asked for their names and units, in order."""
    lines, wanted = [], iter(signals.items())
    for line in mapping.read_text().splitlines():
        if line.startswith("name ="):
            name, (unit, _) = next(wanted)
            line = f'name = "{name}"'
        elif line.startswith("unit ="):
            line = f'unit = "{unit}"'
        lines.append(line)
    mapping.write_text("\n".join(lines))
