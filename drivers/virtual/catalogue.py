"""An instrument tells what its channels measure."""

from collections.abc import Sequence

from drivers.scpi import ScpiError, command
from recordings.run import Channel


class Catalogue:
    """Commands that describe `_channels`, for an instrument to inherit."""

    _channels: Sequence[Channel]

    @command("CHANnel:COUNt?")
    def _channel_count(self) -> int:
        """How many channels it has."""
        return len(self._channels)

    @command("CHANnel:CATalog?")
    def _catalogue(self) -> str:
        """Their names."""
        return ",".join(f'"{channel.name}"' for channel in self._channels)

    @command("CHANnel#:DESCription?")
    def _describe_channel(self, number: int) -> str:
        """Name, quantity, unit, position in m (9.91E37 if unknown), direction, range (0 if none) of a channel."""
        if not 1 <= number <= len(self._channels):
            raise ScpiError(-114, f"there are {len(self._channels)} channels")
        channel = self._channels[number - 1]
        position = "9.91E37" if channel.position_m is None else repr(float(channel.position_m))
        limit = repr(float(channel.range or 0.0))
        return f'"{channel.name}","{channel.quantity}","{channel.unit}",{position},"{channel.direction}",{limit}'
