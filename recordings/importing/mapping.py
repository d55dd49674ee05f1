"""What a foreign file does not say of itself, in a small TOML file beside it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import Field, field_validator

from recordings.directions import Direction
from recordings.numbers import Finite, Positive
from recordings.quantities import known_quantities, quantity_of_unit
from recordings.toml_input import Name, Table, read_toml
from recordings.whole import whole_file

_SENSITIVITY = re.compile(r"([-+0-9.eE]+)\s*([mµuμ]?V)\s*/\s*\(?(.+?)\)?")


class ChannelMapping(Table):
    """One column that becomes a channel.

    ``sensitivity = "10.2 mV/g"`` turns volts into what was measured; `scale` comes before it, from a sound file's
    -1 ... 1 to volts for one.
    """

    column: str = Field(min_length=1)
    name: Name | None = None
    unit: str = ""
    quantity: str | None = None
    scale: Finite = 1.0
    sensitivity: str | None = None
    position_m: Finite | None = None
    direction: Direction = "+y"

    @field_validator("quantity")
    @classmethod
    def _is_one(cls, value: str | None) -> str | None:
        if value is not None and value not in known_quantities():
            raise ValueError(f"there are {', '.join(known_quantities())}")
        return value

    @field_validator("sensitivity")
    @classmethod
    def _is_read(cls, value: str | None) -> str | None:
        if value is not None:
            parse_sensitivity(value)
        return value


class Mapping(Table):
    """How columns become a recording; columns that it does not list are left out, all are taken where it lists none."""

    sample_rate_Hz: Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)] | None = None
    time: str | None = None
    time_unit: Literal["s", "ms", "us", "ns", "min", "h"] | None = None
    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | None = None
    decimal: Literal[".", ","] | None = None
    excitation: Literal["found", "stepped-sine", "broadband"] = "found"
    target: Name | None = None
    preload_N: Positive | None = None
    preload_Nm: Positive | None = None
    channel: list[ChannelMapping] = Field(default=[], max_length=1024)


def parse_sensitivity(text: str) -> tuple[float, str]:
    """Volts per unit, and the unit; ValueError if it says something else."""
    found = _SENSITIVITY.fullmatch(text.strip())
    volts = quantity_of_unit(found[2]) if found else None
    if found is None or volts is None or quantity_of_unit(found[3]) is None:
        raise ValueError(f"{text!r:.40} is no sensitivity; write it as '10.2 mV/g' or '22.4 mV/lbf'")
    value = float(found[1]) * volts[1]
    if not 1e-12 < abs(value) < 1e12:
        raise ValueError("a sensitivity of 0 says nothing about the quantity")
    return value, found[3]


def mapping_beside(path: Path) -> Path:
    """Where the mapping of a file is looked for, and written if something must be asked."""
    return path.with_name(f"{path.name}.mapping.toml")


def read_mapping(path: Path) -> Mapping:
    """Read a mapping; raises InputError with the field that is wrong."""
    return read_toml(path, Mapping)


@dataclass(frozen=True, kw_only=True)
class MappingQuestion:
    """What is not known: the field that is to be filled in, of a channel or of all, and why."""

    field: str
    why: str
    column: str = ""


def write_mapping(
    path: Path, mapping: Mapping, columns: Sequence[ChannelMapping], questions: Sequence[MappingQuestion]
) -> None:
    """Write what is known of every column, with a marked line for each question; raises InputError if it cannot be."""
    lines = [
        "# How columns become channels.  Fill in what is marked with <-, and take out columns that are no channels.",
        '# More fields of a channel: quantity, position_m, scale, direction, sensitivity = "10.2 mV/g" for volts.',
    ]
    lines += [f"# {each.field} =        # <- {_line(each.why)}" for each in questions if not each.column]
    said = mapping.model_dump(exclude_none=True, exclude_defaults=True, exclude={"channel"})
    lines += tomli_w.dumps(said).splitlines()
    for channel in columns:
        asked = {each.field: each.why for each in questions if each.column == channel.column}
        lines += ["", "[[channel]]"]
        known = {"column": channel.column, **channel.model_dump(exclude_none=True, exclude_defaults=True)}
        for field, value in known.items():
            if field not in asked:
                lines.append(tomli_w.dumps({field: value}).rstrip())
        lines += [f'{field} = ""        # <- {_line(why)}' for field, why in asked.items()]
    with whole_file(path) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _line(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)
