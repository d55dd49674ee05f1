"""``twin cite``: what to cite for this program and for the methods that results used."""

import json
import tomllib
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click

from recordings.errors import InputError
from twin.commands.common.options import json_option
from twin.commands.common.output import print_json

Reference = dict[str, Any]
NOT_USED = ("excluded", "set_95", "confused_with", "next_test", "warnings")
"""Parts of a result whose names of causes say nothing of what it rests on; that they are there does."""
FIELDS = {"version": "version", "journal": "journal", "volume": "volume", "number": "issue", "doi": "doi"}
"""Of the Citation File Format, by BibTeX's; types likewise."""
TYPES = {"inproceedings": "conference-paper", "techreport": "report"}


@click.command(short_help="What to cite for the methods that results used, as BibTeX or CFF.")
@click.argument("results", metavar="[RESULT...]", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--format", "form", type=click.Choice(["bibtex", "cff"]), default="bibtex", show_default=True, help="Of the list."
)
@json_option
def command(results: tuple[Path, ...], form: str, as_json: bool) -> None:
    """List the program and the works whose methods each RESULT used; without a RESULT, all that the program cites.

    A RESULT is a folder of `twin diagnose`, `demo`, `rehearse` or `campaign`, what `--json` printed, a model, a
    recording, or a table of frequencies.
    """
    words = {word for path in results for word in words_of(path)} if results else None
    cited = references(words)
    if as_json:
        print_json({"results": results, "references": [{"key": key, **work} for key, work in cited.items()]})
    else:
        click.echo(as_bibtex(cited) if form == "bibtex" else as_cff(cited), nl=False)


def references(words: set[str] | None = None) -> dict[str, Reference]:
    """The program and the works that belong to a result's words, or all, by key; fields are BibTeX's."""
    works = tomllib.loads(Path(__file__).with_name("references.toml").read_text(encoding="utf-8"))
    program = {**works.pop("virtual-test-rig"), "version": version("virtual-test-rig")}
    used = {key: work for key, work in works.items() if words is None or words & set(work["used_by"])}
    return {"virtual-test-rig": program, **used}


def words_of(path: Path) -> set[str]:
    """All keys and values of a result, of a model or of a recording's rig and procedure; the columns of a table."""
    from recordings.reader import read_run

    if path.is_dir():
        inside = [path / name for name in ("result.json", "campaign.json") if (path / name).exists()]
        if not inside:
            raise InputError(path, "", "holds no result.json and no campaign.json", "give a folder of results")
        return {word for one in [*inside, *path.glob("extended.toml")] for word in words_of(one)}
    kind = path.suffix.lower()
    try:
        if kind == ".mcap":
            return set(_words([tomllib.loads(data.decode()) for data in read_run(path).attachments.values()]))
        text = path.read_text(encoding="utf-8")
        if kind == ".csv":
            return set(text.partition("\n")[0].strip().split(","))
        return set(_words(json.loads(text) if kind == ".json" else tomllib.loads(text)))
    except FileNotFoundError:
        raise InputError(path, "", "no such file") from None
    except ValueError as error:
        raise InputError(
            path, "", f"is no result: {error}", "give a folder of results, JSON, TOML, CSV or MCAP"
        ) from None


def _words(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield key
            yield from () if key in NOT_USED else _words(item)
    elif isinstance(value, list):
        for item in value:
            yield from _words(item)
    elif isinstance(value, str):
        yield value


def as_bibtex(cited: dict[str, Reference]) -> str:
    """The works as BibTeX; what each is used for is its note."""
    entries = []
    for key, work in cited.items():
        fields = {name: value for name, value in work.items() if name not in ("type", "used_for", "used_by")}
        fields["note"] = f"used for: {work['used_for']}"
        lines = "".join(f"  {name} = {{{str(value).replace('&', chr(92) + '&')}}},\n" for name, value in fields.items())
        entries.append(f"@{work['type']}{{{key},\n{lines}}}\n")
    return "\n".join(entries)


def as_cff(cited: dict[str, Reference]) -> str:
    """The program in the Citation File Format 1.2, with the works as its references."""
    program, *works = (
        [f"{name}: {json.dumps(value)}" for name, value in _cff(work).items()] for work in cited.values()
    )
    lines = [
        "cff-version: 1.2.0",
        "message: If you use this software, please cite it and the works whose methods you used (twin cite RESULT).",
        *program,
        "license: MIT",
        "references:",
        *("  - " + "\n    ".join(work) for work in works),
    ]
    return "\n".join(lines) + "\n"


def _cff(work: Reference) -> dict[str, Any]:
    names = [name.strip("{}").partition(", ") for name in work["author"].split(" and ")]
    first, _, last = work.get("pages", "").partition("-")
    fields = {
        "type": TYPES.get(work["type"], work["type"]),
        "title": work["title"],
        "authors": [{"family-names": a, "given-names": b} if b else {"name": a} for a, _, b in names],
        "year": work.get("year"),
        **{theirs: work.get(ours) for ours, theirs in FIELDS.items()},
        "start": first,
        "end": last,
    }
    return {name: value for name, value in fields.items() if value}
