"""A source of samples and some addresses become the virtual instruments of a rig."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import can

from drivers.addresses import Address, parse_can, parse_tcp
from drivers.bus import open_bus
from drivers.can_dialect import make_dialect
from drivers.virtual.bus_time import BusTime
from drivers.virtual.can_node import CanLine, CanNode
from drivers.virtual.control import Protection
from drivers.virtual.daq import AcquisitionInstrument
from drivers.virtual.faults import Fault, FaultPlan
from drivers.virtual.feed import SampleFeed
from drivers.virtual.line_speed import WirePort
from drivers.virtual.meter import Meter
from drivers.virtual.ports import DEFAULT_BAUD, DEVICES, TERMINALS, Port, PtyPort, SerialPort, TcpPort
from drivers.virtual.server import VirtualDevice, serve
from drivers.virtual.slcan import SlcanAdapter
from recordings.errors import InputError, blamed_on
from recordings.run import Channel
from recordings.streams import SampleSource, SlowSource

DEFAULT_BITRATE, DEFAULT_DATA_BITRATE = 1e6, 5e6
NODES = ("can", "can2")
"""Names of the nodes of one bus."""


@dataclass(frozen=True, kw_only=True)
class Addresses:
    """Where the instruments are to listen, as on the command line.

    `serial` is ``auto`` for a new pseudo-terminal, a serial port of this machine, or a name that does not exist yet,
    which becomes a link to a pseudo-terminal; `tcp` is ``HOST:PORT`` with port 0 for any; `meter`, for the slow one, is
    like either; `can` is ``INTERFACE:CHANNEL``, where the channel of ``slcan`` is like `serial`; `can_channels` are the
    channels that go over CAN instead of the line, `second_can_channels` those of a second node on the bus.  With `baud`
    a pseudo-terminal is as slow as a wire, and deaf to other rates; `bitrate` and `data_bitrate` limit the CAN bus,
    whose frames are ``fd`` or ``classic``.
    Neither speed is limited where the rig runs as fast as it can.
    """

    serial: str | None = None
    tcp: str | None = None
    can: str | None = None
    meter: str | None = None
    can_channels: tuple[str, ...] = ()
    second_can_channels: tuple[str, ...] = ()
    baud: int | None = None
    bitrate: float = DEFAULT_BITRATE
    data_bitrate: float = DEFAULT_DATA_BITRATE
    can_frames: str = "fd"

    def __post_init__(self) -> None:
        """Refuse addresses that make no sense before anything is opened; raises InputError."""
        if self.tcp is not None:
            _parsed(parse_tcp, "--tcp", self.tcp)
        if self.can is not None:
            where = _parsed(parse_can, "--can", self.can)
            if where.interface == "slcan":
                _check_there("--can", where.channel)
        for option, line in (("--serial", self.serial), ("--meter", self.meter)):
            if line is not None:
                _check_there(option, line)


@dataclass(frozen=True, kw_only=True)
class Backing:
    """What backs the instruments beside their source."""

    origin: str = "simulated"
    """What a recording of it is, ``simulated`` or ``replayed``; the third field of ``*IDN?`` says so."""
    renew: Callable[[], SampleSource] | None = None
    """Makes a source in place of one that has failed, when a client starts again."""
    slow: SlowSource | None = None
    """What the meter measures, where there is to be one."""


class VirtualRig:
    """The instruments of one source, ready to be served.

    Parameters
    ----------
    source
        What stands behind them.
    addresses
        Where they listen; a pseudo-terminal if nothing is said.
    backing
        Where it comes from, what renews it, and what the meter measures.
    speed
        Multiple of real time; None for as fast as the clients take it.
    faults, seed
        What goes wrong, and the seed of it.
    protection
        What guards the rig against its clients.

    Raises
    ------
    InputError
        If an address cannot be used, or a channel or fault does not fit.
    """

    def __init__(
        self,
        source: SampleSource,
        addresses: Addresses,
        *,
        backing: Backing = Backing(),
        speed: float | None = None,
        faults: Sequence[Fault] = (),
        seed: int = 0,
        protection: Protection | None = None,
    ) -> None:
        self._speed = speed
        self._protection = protection
        self._origin, slow = backing.origin, backing.slow
        self._baud = addresses.baud
        self._rates = addresses.bitrate, addresses.data_bitrate
        self._can_frames = addresses.can_frames
        self._feed = SampleFeed(source, flow_controlled=speed is None, renew=backing.renew)
        on_line, *on_can = split_channels(source.channels, addresses)
        nodes = [(name, channels) for name, channels in zip(NODES, on_can, strict=True) if channels]
        names = [*(["daq"] if on_line else []), *(name for name, _ in nodes)]
        if addresses.meter is not None:
            if slow is None or not slow.channels:
                raise InputError("--meter", "", "there is nothing for it to measure")
            names.append("meter")
        self._faults = FaultPlan(faults, seed=seed, devices=names, channels=source.channels)
        self._devices: list[VirtualDevice] = []
        self.ready: list[dict[str, str]] = []
        try:
            if on_line:
                self._add_line(addresses, on_line)
            for number, (name, channels) in enumerate(nodes):
                self._add_can(addresses, name, number, channels)
            if addresses.meter is not None and slow is not None:
                self._add_meter(addresses.meter, addresses.baud, slow, seed)
        except BaseException:
            self.close()
            raise

    def _add_line(self, addresses: Addresses, channels: list[str]) -> None:
        ports: list[Port | TcpPort] = []
        try:
            if addresses.serial is not None or (addresses.tcp is None and addresses.can is None):
                ports.append(open_serial(addresses.serial or "auto", addresses.baud, self._speed))
                self.ready.append({"device": "daq", "serial": ports[-1].address})
            if addresses.tcp is not None:
                where = _parsed(parse_tcp, "--tcp", addresses.tcp)
                ports.append(TcpPort(where.host, where.port))
                self.ready.append({"device": "daq", "tcp": ports[-1].address})
        except BaseException:
            for port in ports:
                port.close()
            raise
        self._devices.append(
            AcquisitionInstrument(
                self._feed,
                channels=channels,
                ports=ports,
                lossless=self._speed is None,
                origin=self._origin,
                faults=self._faults.link("daq"),
                protection=self._protection,
            )
        )

    def _add_can(self, addresses: Addresses, name: str, number: int, channels: list[str]) -> None:
        assert addresses.can is not None
        where = _parsed(parse_can, "--can", addresses.can)
        told = addresses.can
        dialect = make_dialect(addresses.can_frames, number)
        if where.interface == "slcan":
            if number:
                raise InputError(
                    "--can-channels", "", "a serial adapter has one node behind it", "use another interface"
                )
            line = open_serial(where.channel, None, self._speed, option="--can")
            bus: can.BusABC = SlcanAdapter(line, bitrate=addresses.bitrate, data_bitrate=addresses.data_bitrate)
            told = f"slcan:{line.address}"
        else:
            rates = {"bitrate": round(addresses.bitrate), "data_bitrate": round(addresses.data_bitrate)}
            bus = open_bus(where, **rates, is_fd=dialect.is_fd)
        bus_time = BusTime(
            bitrate=addresses.bitrate, data_bitrate=addresses.data_bitrate, multiple=self._speed, is_fd=dialect.is_fd
        )
        try:
            self._devices.append(
                CanNode(
                    self._feed,
                    CanLine(bus=bus, bus_time=bus_time, dialect=dialect),
                    name=name,
                    channels=channels,
                    lossless=self._speed is None,
                    faults=self._faults.link(name),
                    clock=self._faults.clock(name),
                )
            )
        except BaseException:
            bus.shutdown()
            raise
        self.ready.append({"device": name, "can": told})

    def _add_meter(self, where: str, baud: int | None, slow: SlowSource, seed: int) -> None:
        host, _, number = where.rpartition(":")
        port: Port | TcpPort
        if host and number.isdigit() and "/" not in where:
            parsed = _parsed(parse_tcp, "--meter", where)
            port = TcpPort(parsed.host, parsed.port)
        else:
            port = open_serial(where, baud, self._speed, option="--meter")
        kind = "tcp" if isinstance(port, TcpPort) else "serial"
        faults = self._faults.link("meter")
        self._devices.append(Meter(self._feed, slow, ports=[port], origin=self._origin, faults=faults, seed=seed))
        self.ready.append({"device": "meter", kind: port.address})

    def serve(self, stopping: Callable[[], bool], *, on_failure: Callable[[str], None] | None = None) -> int:
        """Serve until told to stop, then close; how often the machine was too slow for the wanted speed.

        `on_failure` is told in words when the source has failed; the instruments go on without it.
        """
        try:
            return serve(
                self._feed, self._devices, speed=self._speed, faults=self._faults, stopping=stopping,
                on_failure=on_failure,
            )  # fmt: skip
        finally:
            self.close()

    def stop_at_once(self, by: str) -> None:
        """Emergency stop, as by a button on the rig; safe in a signal's handler."""
        self._feed.halt(f"emergency stop by {by}", latched=True)

    def close(self) -> None:
        """Close what was opened, where it is not served."""
        for device in self._devices:
            device.close()
        self._devices.clear()

    @property
    def fault_hits(self) -> Mapping[str, int]:
        """How often each kind of fault has happened so far."""
        return self._faults.hits

    @property
    def instruments_toml(self) -> str:
        """The instruments file of a client of this rig.

        Raises
        ------
        InputError
            If no device has the generator.
        """
        lines: list[str] = []
        for entry in self.ready:
            device = entry["device"]
            if any(f'name = "{device}"' in line for line in lines):
                continue  # a second address of the same device
            kind = next(key for key in entry if key != "device")
            lines += ["[[device]]", f'name = "{device}"', f'address = "{kind}:{entry[kind]}"']
            if self._baud is not None and kind == "serial":
                lines.append(f"baud = {self._baud}")
            if kind == "can" and self._rates != (DEFAULT_BITRATE, DEFAULT_DATA_BITRATE):
                lines += [f"bitrate = {self._rates[0]:.0f}", f"data_bitrate = {self._rates[1]:.0f}"]
            if kind == "can" and self._can_frames != "fd":
                lines.append(f'frames = "{self._can_frames}"')
            if device == NODES[1]:
                lines.append("node = 1")
            lines += {"daq": ["generator = true"], "meter": ['kind = "meter"']}.get(device, [])
            lines.append("")
        if "generator = true" not in lines:
            raise InputError("--instruments-out", "", "a CAN node alone has no generator", "add --serial or --tcp")
        return "\n".join(lines)


def _parsed(parse: Callable[[str], Address], option: str, text: str) -> Address:
    with blamed_on(option):
        return parse(text)


def split_channels(channels: Sequence[Channel], addresses: Addresses) -> tuple[list[str], list[str], list[str]]:
    """Names of the channels on the line, on the first and on the second CAN node.

    If nothing is said, the last acceleration goes over CAN where there is both; a CAN bus alone carries all.
    """
    names = [channel.name for channel in channels]
    if addresses.can is None:
        if addresses.can_channels:
            raise InputError("--can-channels", "", "there is no --can for them")
        return names, [], []
    second = list(addresses.second_can_channels)
    wanted = [*addresses.can_channels, *second]
    unknown = [name for name in wanted if name not in names]
    if unknown:
        raise InputError("--can-channels", unknown[0], "no such channel", "there are " + ", ".join(names))
    twice = [name for name in second if name in addresses.can_channels]
    if twice:
        raise InputError("--can-channels", twice[0], "is on both nodes")
    if addresses.serial is None and addresses.tcp is None:
        return [], list(addresses.can_channels or names), second
    on_can = list(addresses.can_channels)
    if not on_can:
        on_can = [channel.name for channel in channels if channel.quantity == "acceleration"][-1:] or names[-1:]
    on_line = [name for name in names if name not in (*on_can, *second)]
    if not on_line:
        raise InputError("--can-channels", "", "nothing is left for the line", "leave --serial and --tcp out")
    return on_line, on_can, second


def open_serial(where: str, baud: int | None, multiple: float | None, *, option: str = "--serial") -> Port:
    """A new pseudo-terminal, one with a name of its own, or a serial port that is there."""
    path = Path(where)
    of_terminal = _is_link_to_terminal(path)
    if where == "auto" or of_terminal or not path.exists():
        terminal = PtyPort(None if where == "auto" else path)
        if baud is None:
            return terminal
        return WirePort(terminal, baud=baud, multiple=multiple)
    if not path.is_char_device():
        raise InputError(option, where, "exists and is no serial port", "give a name that is free, or auto")
    return SerialPort(where, baud or DEFAULT_BAUD)


def _check_there(option: str, where: str) -> None:
    """Raises InputError for a device of this machine that is absent."""
    path = Path(where)
    if path.is_relative_to(DEVICES) and not (path.exists() or _is_link_to_terminal(path)):
        raise InputError(option, where, "no such device", "plug it in, or give auto or a name outside of /dev")


def _is_link_to_terminal(path: Path) -> bool:
    """Also to one that has gone."""
    return path.is_symlink() and str(path.readlink()).startswith(TERMINALS)
