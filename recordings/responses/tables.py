"""Frequency responses as CSV, a line of a response on each row, and as NumPy archives, as sdypy has them."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from recordings.columns import Columns
from recordings.errors import InputError, blamed_on
from recordings.quantities import QUANTITIES
from recordings.reader import open_input
from recordings.responses.found import SIZE_LIMIT_BYTES, End, FoundResponse, Responses, checked
from recordings.responses.units import factor_of_label

PARTS = ({"real", "imag"}, {"amplitude", "phase_deg"}, {"amplitude", "phase_rad"})
"""Columns of which a CSV has one pair."""
FORMS = {one.per_force: one.name for one in QUANTITIES if one.per_force}
KEYS = {"frequency_Hz", "frf"}
"""Without which an archive holds no responses."""


def has_responses(path: Path) -> bool:
    """Whether a CSV's column names are those of frequency responses."""
    with open_input(path) as stream:
        text = stream.read(4096).decode("utf-8", "replace")
    head = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    names = {name.strip().strip('"') for name in head.split(",")}
    return "frequency_Hz" in names and any(pair <= names for pair in PARTS)


def read_csv(path: Path) -> Responses:
    """Read a CSV: `frequency_Hz`, `real` and `imag` (or `amplitude` and `phase_deg` or `phase_rad`).

    Further columns that it may have: `response`, `reference`, `unit` (of the quotient), `coherence`, `averages`.

    Raises
    ------
    InputError
        With the line, if a value is missing or impossible.
    """
    table = Columns(path, "frequency_Hz")
    pair = next((pair for pair in PARTS if pair <= set(table.names)), None)
    if pair is None:
        raise InputError(path, "line 1", "has no columns real and imag", "or amplitude and phase_deg")
    if "real" in pair:
        H = table.numbers("real") + 1j * table.numbers("imag")
    else:
        phase = np.deg2rad(table.numbers("phase_deg")) if "phase_deg" in pair else table.numbers("phase_rad")
        H = table.numbers("amplitude", least=0) * np.exp(1j * phase)
    frequency, coherence = table.numbers("frequency_Hz", least=0), table.optional("coherence")
    averages = table.optional("averages", least=0)
    columns = [table.texts(name) for name in ("response", "reference", "unit")]
    rows: dict[tuple[str, ...], list[int]] = {}
    for row, key in enumerate(zip(*columns, strict=True)):
        rows.setdefault(key, []).append(row)
    found = []
    for (response, reference, unit), own in rows.items():
        place = f"line {table.line[own[0]]}, column unit"
        quantity, factor = _unit(path, place, unit)
        given = None if np.isnan(coherence[own]).any() else coherence[own]
        x, y, g = checked(path, f"line {table.line[own[0]]}", frequency_Hz=frequency[own], H=H[own], coherence=given)
        count = averages[own[0]]
        found.append(
            FoundResponse(
                place=f"line {table.line[own[0]]}", response=End(response), reference=End(reference),
                quantity=quantity, frequency_Hz=x, H=y * factor, coherence=g,
                averages=0 if np.isnan(count) else int(count),
            )
        )  # fmt: skip
    return Responses(path=str(path), responses=tuple(found))


def _unit(path: Path, place: str, label: str) -> tuple[str, float]:
    if not label:
        return "", 1.0
    with blamed_on(path, place):
        return factor_of_label(label)


def read_archive(path: Path) -> Responses:
    """Read an ``.npz``: `frequency_Hz` (f,) and `frf`, complex, (f,), (n, f) or (responses, references, f).

    It may have `channels`, names of the responses; `references`; `coherence`, as `frf`; `averages`; `unit` of the
    quotient, or `frf_form`: accelerance, mobility or receptance.

    Raises
    ------
    InputError
        With the key, if one is missing or has another shape or type.
    """
    arrays = _arrays(path)
    if missing := KEYS - set(arrays):
        raise InputError(path, "", f"has no {' and no '.join(sorted(missing))}", f"it has {', '.join(arrays)[:120]}")
    frf = np.asarray(arrays["frf"])
    frf = frf[None, None] if frf.ndim == 1 else frf[:, None] if frf.ndim == 2 else frf
    if frf.ndim != 3 or frf.dtype.kind != "c":
        raise InputError(path, "frf", "is no array of complex numbers (responses, references, frequencies)")
    responses, references = (
        _names(path, arrays, key, n) for key, n in zip(("channels", "references"), frf.shape, strict=False)
    )
    coherence = None if "coherence" not in arrays else np.asarray(arrays["coherence"], float).reshape(frf.shape)
    averages = int(arrays.get("averages", 0))
    form = str(arrays.get("frf_form", ""))
    if form and form not in FORMS:
        raise InputError(path, "frf_form", f"is {form!r:.40}", f"it is one of {', '.join(FORMS)}")
    quantity, factor = _unit(path, "unit", str(arrays.get("unit", "")))
    found = []
    for row, response in enumerate(responses):
        for column, reference in enumerate(references):
            place = f"frf[{row}, {column}]"
            x, H, g = checked(
                path, place, frequency_Hz=np.asarray(arrays["frequency_Hz"], float), H=frf[row, column] * factor,
                coherence=None if coherence is None else coherence[row, column],
            )  # fmt: skip
            found.append(
                FoundResponse(
                    place=place, response=End(response), reference=End(reference),
                    quantity=quantity or FORMS.get(form, ""), frequency_Hz=x, H=H, coherence=g, averages=averages,
                )
            )  # fmt: skip
    return Responses(path=str(path), responses=tuple(found))


def _names(path: Path, arrays: dict[str, Any], key: str, count: int) -> list[str]:
    names = [str(name) for name in np.atleast_1d(arrays.get(key, [""] * count))]
    if len(names) != count:
        raise InputError(path, key, f"has {len(names)} names for {count} of frf's")
    return names


def _arrays(path: Path) -> dict[str, Any]:
    try:
        with open_input(path) as stream:
            with zipfile.ZipFile(stream) as archive:
                if sum(member.file_size for member in archive.infolist()) > SIZE_LIMIT_BYTES:
                    raise InputError(path, "", f"holds more than {SIZE_LIMIT_BYTES >> 20} MiB")
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, KeyError, NotImplementedError) as error:
        raise InputError(path, "", "is no NumPy archive of plain arrays", "write it with numpy.savez") from error
