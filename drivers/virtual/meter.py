"""The slow meter of preload and temperature: plain SCPI, a new value of each channel every 100 ms of the rig's time."""

import math
from collections.abc import Sequence

import numpy as np

from drivers.scpi import Integer, ScpiError, command
from drivers.virtual.catalogue import Catalogue
from drivers.virtual.conversing import Conversing
from drivers.virtual.faults import LinkFaults
from drivers.virtual.feed import SampleFeed
from drivers.virtual.ports import Port, TcpPort
from recordings.run import SampleBlock
from recordings.streams import SlowSource

CONVERSION_NS = 100_000_000
STEPS = 1 << 15
"""Steps of the converter up to its range."""
NOISE_STEPS = 0.5
OVERRANGE = 9.9e37
"""What SCPI writes for a value beyond the range."""


class Meter(Catalogue, Conversing):
    """Quantities that change slowly, behind one or more ports.

    Parameters
    ----------
    feed
        Whose time it lives in.
    source
        What it measures.  A channel with a range goes through a converter with noise; one without is told as it is.
    ports
        Lines it listens on.
    seed
        Of its noise.
    """

    listening = False
    has_room = True

    def __init__(
        self,
        feed: SampleFeed,
        source: SlowSource,
        *,
        name: str = "meter",
        ports: Sequence[Port | TcpPort],
        origin: str = "simulated",
        faults: LinkFaults | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__()
        self.identity = ("Virtual Test Rig", "METER", origin, "1.0")
        self.name = name
        self._channels = tuple(source.channels)
        self._source = source
        self._feed = feed
        self._seed = seed
        self.attach(ports, faults)

    def _value(self, number: int) -> float:
        """The latest conversion of a channel: whoever asks within the same 100 ms gets the same."""
        conversion = self._feed.next_time_ns // CONVERSION_NS
        true = self._source.read(conversion * CONVERSION_NS * 1e-9)[number]
        limit = self._channels[number].range
        if limit is None:
            return float(true)
        step = limit / STEPS
        noise = NOISE_STEPS * np.random.default_rng([self._seed, number, conversion]).standard_normal()
        steps = round(true / step + noise) if math.isfinite(true) else STEPS + 1
        return math.copysign(OVERRANGE, true) if abs(steps) > STEPS else steps * step

    @command("READ?")
    def _read_all(self) -> tuple[float, ...]:
        """The latest value of every channel, in order; 9.9E37 is beyond the range."""
        return tuple(self._value(number) for number in range(len(self._channels)))

    @command("MEASure:PRELoad?")
    def _measure_preload(self) -> float:
        """Preload of the joint, in N."""
        return self._measure("preload")

    @command("MEASure:TEMPerature?")
    def _measure_temperature(self) -> float:
        """Temperature of the structure, in degC."""
        return self._measure("temperature")

    @command("MEASure:CHANnel?", Integer(minimum=1, maximum=64))
    def _measure_channel(self, number: int) -> float:
        """One channel by its number, in its unit."""
        if number > len(self._channels):
            raise ScpiError(-222, f"there are {len(self._channels)} channels")
        return self._value(number - 1)

    def _measure(self, quantity: str) -> float:
        for number, channel in enumerate(self._channels):
            if channel.quantity == quantity:
                return self._value(number)
        raise ScpiError(-241, f"no sensor of {quantity}")

    def accept(self, block: SampleBlock) -> None:
        """Samples of the other instruments are not its business, but time is."""
        self.pass_time(1e-9 * block.time_ns + len(block) / block.sample_rate_Hz)

    def end(self) -> None:
        """It goes on without the others."""

    def fail(self, reason: str) -> None:
        """It goes on without the others."""
