"""What `twin serve` and `twin replay` share: the options of the instruments, and serving until told to stop."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_file
from twin.commands.common.options import FiniteRange, overwrite_option
from twin.commands.common.output import say
from twin.commands.common.stopping import ASKED, handling

if TYPE_CHECKING:
    from recordings.streams import SampleSource, SlowSource

_OPTIONS = [
    click.option("--serial", metavar="auto|PATH", help="New pseudo-terminal, a name for one, or a port."),
    click.option("--tcp", metavar="HOST:PORT", help="SCPI and samples over TCP; port 0 takes any that is free."),
    click.option("--can", metavar="INTERFACE:CHANNEL", help="CAN node on any python-can interface."),
    click.option(
        "--can-channels", metavar="NAME,...[/NAME,...]", default="",
        help="Channels on CAN instead of the line; after the stroke, those of a second node.",
    ),
    click.option(
        "--can-frames", type=click.Choice(["fd", "classic"]), default="fd", show_default=True,
        help="What the bus carries; in classic frames samples are decimated as far as it needs.",
    ),
    click.option(
        "--bitrate", type=click.IntRange(10_000, 1_000_000), default=1_000_000, show_default=True,
        help="Of the CAN bus, bit/s; in real time it carries no more.",
    ),
    click.option(
        "--data-bitrate", type=click.IntRange(10_000, 8_000_000), default=5_000_000, show_default=True,
        help="Of the data in CAN FD frames, bit/s.",
    ),
    click.option("--baud", type=click.IntRange(300, 20_000_000), help="Make the line as slow as a wire."),
    click.option(
        "--watchdog", type=FiniteRange(0.1, 60.0), default=5.0, show_default=True, metavar="S",
        help="How long the generator drives on for a stream whose client has gone.",
    ),
    click.option(
        "--idle", type=FiniteRange(1.0, 86400.0), default=300.0, show_default=True, metavar="S",
        help="A client that is silent for so long is hung up.",
    ),
    click.option(
        "--drive-limit", type=FiniteRange(0.0, 10.0), default=10.0, show_default=True, metavar="V",
        help="Amplitude of the generator that no client can pass.",
    ),
    click.option("--speed", default="1", metavar="N|fast", show_default=True, help="Multiple of real time."),
    click.option("--fault", "faults", multiple=True, metavar="KIND:KEY=VALUE,...", help="Go wrong on purpose."),
    click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of noise and faults."),
    click.option(
        "--instruments-out", type=click.Path(dir_okay=False, path_type=Path), help="Write the client's file here."
    ),
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Serving:
    """How the instruments behave, and where they listen."""

    seed: int
    speed: str
    faults: tuple[str, ...]
    watchdog: float
    idle: float
    drive_limit: float
    can_channels: str
    instruments_out: Path | None
    overwrite: bool
    addresses: Mapping[str, Any]
    """Of :class:`drivers.virtual.Addresses`."""


def address_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options that say where the instruments listen and how they behave, as the argument `serving`."""
    behaviour = [field.name for field in fields(Serving) if field.name != "addresses"]
    where = ("serial", "tcp", "can", "can_frames", "bitrate", "data_bitrate", "baud")

    @wraps(function)
    def gathered(*arguments: Any, **given: Any) -> Any:
        own = {name: given.pop(name) for name in behaviour}
        serving = Serving(**own, addresses={name: given.pop(name) for name in where})
        return function(*arguments, serving=serving, **given)

    for option in reversed([*_OPTIONS, overwrite_option]):
        gathered = option(gathered)
    return gathered


def serve_source(
    open_source: Callable[[], SampleSource], serving: Serving, *, origin: str, as_json: bool, meter: str | None,
    slow: SlowSource | None,
) -> None:  # fmt: skip
    """Open a source and serve it until SIGINT or SIGTERM, telling the addresses as JSON lines when they are ready.

    SIGUSR1 is the emergency stop: the generator's output to zero, every stream ended, until a client clears it.

    `origin` is what a recording made from it is: simulated or replayed; `meter` is where a slow meter listens, `slow`
    what it reads.  InputError if an option cannot be used.
    """
    from drivers.virtual import Addresses, Backing, Protection, VirtualRig, parse_fault

    check_writable(serving.instruments_out, overwrite=serving.overwrite)
    told_to_stop: list[int] = []
    first, second = _parse_can_channels(serving.can_channels)
    where = Addresses(can_channels=first, second_can_channels=second, meter=meter, **serving.addresses)
    multiple, parsed_faults = _parse_speed(serving.speed), [parse_fault(fault) for fault in serving.faults]
    rig = VirtualRig(
        open_source(), where, speed=multiple, faults=parsed_faults, seed=serving.seed,
        protection=Protection(watchdog_s=serving.watchdog, idle_s=serving.idle, drive_limit_V=serving.drive_limit),
        backing=Backing(origin=origin, renew=open_source, slow=slow),
    )  # fmt: skip
    handlers: dict[signal.Signals, Any] = dict.fromkeys(ASKED, lambda asked, _: told_to_stop.append(asked))
    with handling({**handlers, signal.SIGUSR1: lambda *_: rig.stop_at_once("signal")}), closing(rig):
        if serving.instruments_out is not None:
            with whole_file(serving.instruments_out) as part:
                part.write_text(rig.instruments_toml, encoding="utf-8")
        if as_json:
            click.echo(json.dumps({"devices": rig.ready}))
        else:
            for entry in rig.ready:
                click.echo(json.dumps({"event": "ready", **entry}))
        slips = rig.serve(
            lambda: bool(told_to_stop),
            on_failure=lambda reason: say(f"twin: the rig has stopped: {reason}; the instruments stay"),
        )
    if slips:
        say(f"this machine was too slow for the wanted speed, {slips} time(s) by more than a second")


def _parse_can_channels(text: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Channels of the first and of the second node."""
    groups = [tuple(name for name in group.split(",") if name) for group in text.split("/")]
    if len(groups) > 2 or (len(groups) == 2 and not all(groups)):
        raise InputError("--can-channels", "", f"not NAME,... or NAME,.../NAME,...: {text[:60]!r}")
    return groups[0], groups[1] if len(groups) == 2 else ()


def _parse_speed(text: str) -> float | None:
    if text == "fast":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0 < speed <= 1e6:
        raise InputError("--speed", "", f"neither a multiple of real time nor fast: {text[:30]!r}")
    return speed
