"""What an instrument says of itself and its channels, as a host reads it."""

import csv
from collections.abc import Callable

from recordings.run import Channel

CHANNELS_LIMIT = 64


def read_identity(ask: Callable[[str], str]) -> str:
    """Maker, model, serial number and version of the instrument that `ask` talks to.

    Raises
    ------
    ValueError
        If it answers otherwise than an IEEE 488.2 instrument does.
    """
    identity = ask("*CLS;*IDN?")
    if identity.count(",") != 3:
        raise ValueError(f"answers *IDN? with {identity[:40]!r}, which is no IEEE 488.2 instrument")
    return identity


def read_catalogue(ask: Callable[[str], str], *, device: str) -> list[Channel]:
    """All channels of the instrument that `ask` talks to, as channels of `device`.

    Raises
    ------
    ValueError
        If it answers with what cannot be understood.
    """
    count = ask("CHAN:COUN?")
    if not count.isdigit() or not 0 < int(count) <= CHANNELS_LIMIT:
        raise ValueError(f"answers CHAN:COUN? with {count[:40]!r}")
    channels = []
    for number in range(1, int(count) + 1):
        text = ask(f"CHAN{number}:DESC?")
        try:
            name, quantity, unit, position, direction, limit = next(csv.reader([text]))
            channels.append(
                Channel(
                    name=name,
                    quantity=quantity,
                    unit=unit,
                    position_m=None if float(position) > 1e37 else float(position),
                    direction=direction,
                    range=float(limit) or None,
                    device=device,
                )
            )
        except (ValueError, StopIteration, csv.Error) as error:
            raise ValueError(f"describes channel {number} as {text[:60]!r}") from error
    return channels
