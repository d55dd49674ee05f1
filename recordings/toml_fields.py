"""Which of pydantic's complaints about a TOML table comes first, and the field that a misspelt one is nearest to."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

NEAR = 0.7
"""Share of letters in common, as difflib counts, from which on a name is taken for a misspelt other one."""
LISTED = 12
"""Fields that are told where none is near."""


def nearest(name: str, names: Iterable[str]) -> str | None:
    """The one of `names` that is most like `name`, small and capital letters alike; None if none is."""
    folded = {each.casefold(): each for each in names}
    found = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=NEAR)
    return folded[found[0]] if found else None


def told_apart(details: Sequence[ErrorDetails], table: Mapping[str, object], model: type[BaseModel]) -> tuple[str, str]:
    """Place and reason of the complaint that explains most.

    A misspelt field is complained of twice, as one that is not known and as one that is missing: the first says more.

    Parameters
    ----------
    details
        What pydantic said, at least one.
    table
        What was read.
    model
        What it should have been.
    """
    unknown = [_Unknown(each["loc"], details, table, model) for each in details if each["type"] == "extra_forbidden"]
    if unknown:
        worst = min(unknown, key=lambda each: (each.meant is None, len(each.place)))
        return _dotted(worst.place), worst.reason
    first = details[0]
    place = _dotted(first["loc"])
    reason = first["msg"].removeprefix("Value error, ")
    value = first.get("input")
    if first["type"] == "missing":
        *parents, name = first["loc"]
        return place, reason + _misspelt(str(name), _table_at(table, parents), _fields(model, parents))
    if first["type"] == "union_tag_not_found":
        name = str(first["ctx"]["discriminator"]).strip("'")
        return f"{place}.{name}", "Field required" + _misspelt(name, _table_at(table, first["loc"]), ())
    if isinstance(value, (int, float, str, bool)):
        reason += f" (got {value!r:.60})"
    return place, reason


class _Unknown:
    """A field that is not known, and the one that is `meant` perhaps."""

    def __init__(
        self,
        place: tuple[int | str, ...],
        details: Sequence[ErrorDetails],
        table: Mapping[str, object],
        model: type[BaseModel],
    ) -> None:
        self.place = place
        *parents, name = place
        given, fields = _table_at(table, parents), _fields(model, parents)
        missing = [str(one["loc"][-1]) for one in details if one["type"] == "missing" and [*one["loc"][:-1]] == parents]
        self._possible = [field for field in fields if field not in given]
        choices = (missing, self._possible, fields)
        self.meant = next((found for names in choices if (found := nearest(str(name), names))), None)

    @property
    def reason(self) -> str:
        """For people."""
        if self.meant:
            return f"no such field, perhaps {self.meant!r} is meant"
        possible = ", ".join(self._possible[:LISTED])
        return "no such field" + (f"; beside what is there, {possible} are possible" if possible else "")


def _dotted(place: Iterable[int | str]) -> str:
    return ".".join(str(part) for part in place)


def _misspelt(name: str, given: Mapping[str, object], fields: Iterable[str]) -> str:
    """What follows on the word that `name` is missing, where a key that nobody knows is near to it."""
    near = nearest(name, set(given) - set(fields))
    return f", perhaps {near!r} is a misspelt {name!r}" if near else ""


def _table_at(table: Mapping[str, object], place: Sequence[int | str]) -> Mapping[str, object]:
    """The table that a place leads to; steps that only name the kind of a table are passed over."""
    here: Any = table
    for part in place:
        if part in (range(len(here)) if isinstance(here, list) else here if isinstance(here, Mapping) else ()):
            here = here[part]
    return here if isinstance(here, Mapping) else {}


def _fields(model: type[BaseModel], place: Sequence[int | str]) -> list[str]:
    """Names that the table at a place may have; of all kinds of table that it might be."""
    here = {model}
    for part in place:
        found = [
            field.annotation
            for each in here
            for name, field in each.model_fields.items()
            if part in (name, field.alias)
        ]
        here = {each for annotation in found for each in _models(annotation)} or here
    return list(dict.fromkeys(field.alias or name for each in here for name, field in each.model_fields.items()))


def _models(annotation: Any) -> set[type[BaseModel]]:
    """The tables in a type such as ``list[A | B]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {annotation}
    return {model for part in get_args(annotation) for model in _models(part)}
