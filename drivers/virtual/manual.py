"""The instruments' manual in Markdown, made of what the code itself goes by: command tables, frames, CAN database."""

from collections.abc import Iterable, Sequence
from inspect import cleandoc

import cantools

from drivers import frames
from drivers.can_protocol import read_dbc
from drivers.scpi import Instrument
from drivers.scpi.errors import STANDARD_MESSAGES
from drivers.virtual.daq import AcquisitionInstrument
from drivers.virtual.meter import Meter

_INTRODUCTION = """\
# The instruments on the wire

Made by `twin serve --commands`; a test holds it and the code equal.

A message is a line that ends with LF, CR LF or CR; its commands are separated by `;`, and a header without a leading
`:` goes on in the subsystem of the one before it.  Capitals are the short form of a header, what stands in brackets may
be left out, `#` is a number.  Numbers take multiples of their unit (`25.3 HZ`, `0.3 kHz`, `500 MV`), `MINimum` and
`MAXimum`; the query of a number that can be set gives its limits (`FREQ? MAX`).  Answers end with LF; blocks are of
definite length (`#` digits length data).  Errors wait in a queue of 16 until `SYSTem:ERRor?` takes them.
"""


def write_manual() -> str:
    """The whole page."""
    parts = [
        _INTRODUCTION,
        "## Generator and acquisition\n",
        _commands(AcquisitionInstrument),
        "## Meter of preload and temperature\n",
        _commands(Meter),
        "## Error numbers\n",
        _table(("number", "message"), ((str(number), text) for number, text in STANDARD_MESSAGES.items())),
        "## The stream of samples\n",
        f"```text\n{cleandoc(frames.__doc__ or '')}\n```\n",
        "## CAN\n",
        "The database is `drivers/rig.dbc`; this is what it says.\n",
        _messages(),
    ]
    return "\n".join(parts)


def _commands(instrument: type[Instrument]) -> str:
    rows = (
        (f"`{row.header}`", ", ".join(f"`{each}`" for each in row.described), row.summary)
        for row in instrument.table().commands
    )
    return _table(("header", "parameters", "does"), rows)


def _messages() -> str:
    database = cantools.database.can.Database()
    database.add_dbc_string(read_dbc())
    rows = []
    for message in sorted(database.messages, key=lambda each: each.frame_id):
        names = [signal.name for signal in sorted(message.signals, key=lambda each: each.start)]
        if len(names) > 8:  # samples, all alike
            names = [*names[:2], "...", names[-1]]
        kind = "FD" if message.is_fd else "classic"
        told = " ".join((message.comment or "").split())
        rows.append((f"`{message.frame_id:#05x}`", message.name, kind, str(message.length), ", ".join(names), told))
    return _table(("identifier", "message", "frame", "bytes", "fields", "meaning"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)
