"""One controller at a time: who may change what the rig does, and what becomes of it when the controller has gone.

Whoever sets something has control while the instrument is in use: it streams, waits for samples, drives, or is locked.
Others may ask, and are refused with -203 if they want to change something.  When the controller has gone its output
goes to zero at once; a stream that was cut waits for its client to come back, for as long as the watchdog allows.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.scpi import Command, Number, ScpiError, command, quoted
from drivers.virtual.conversing import Conversing
from drivers.virtual.faults import LinkFaults
from drivers.virtual.feed import SampleFeed
from drivers.virtual.generator import AMPLIFIER_V
from drivers.virtual.ports import Port, TcpPort
from drivers.virtual.readings import Readings
from drivers.virtual.session import Session

TAKE_OVER_S = 30.0
"""Silence after which a controller must let another take over: a program that measures speaks every second."""


@dataclass(frozen=True, kw_only=True)
class Protection:
    """What guards rig and instruments against their clients.

    `watchdog_s` is how long the generator may drive for a stream whose client has gone; `idle_s` how long a client may
    be silent before it is hung up; `drive_limit_V` the amplitude that no client can pass.
    """

    watchdog_s: float = 5.0
    idle_s: float = 300.0
    drive_limit_V: float = AMPLIFIER_V


class Control(Conversing, Readings):
    """An instrument with a generator whose clients cannot get in each other's way.

    Parameters
    ----------
    feed
        Where samples come from.
    ports, faults
        Lines it listens on, and what goes wrong on them.
    protection
        Its limits.
    """

    def __init__(
        self,
        feed: SampleFeed,
        *,
        ports: Sequence[Port | TcpPort],
        faults: LinkFaults | None,
        protection: Protection | None,
    ) -> None:
        self._protection = protection or Protection()
        super().__init__(feed, drive_limit_V=self._protection.drive_limit_V)
        self.attach(ports, faults)
        self.idle_s = self._protection.idle_s
        self._watchdog_s = self._protection.watchdog_s
        self._owner: Session | None = None
        self._locked = False
        self._gone_at: float | None = None

    @property
    def _in_use(self) -> bool:
        return self._locked or self._output_on or self.listening

    def holds(self, session: Session) -> bool:
        """Whether a session has control."""
        return session is self._owner and self._in_use

    def admit(self, row: Command) -> None:
        """Refuse what another client's work would suffer from; raises ScpiError -203."""
        if row.controls:
            self._take_control()

    def _take_control(self) -> None:
        if self._owner is self._speaking:
            return
        if self._owner is not None and self._in_use and self._owner.silent_s < TAKE_OVER_S:
            raise ScpiError(-203, f"{self._owner.name} has control")
        self._let_go()
        self._owner = self._speaking

    def _let_go(self) -> None:
        """Whose work it was, it is over: no output, no stream, no lock."""
        self._owner, self._locked, self._gone_at = None, False, None
        self.abandon_reading()
        self.end_stream()
        if self._output_on:
            self._output_on = False
            self.end_message()

    def client_left(self, session: Session) -> None:
        """Without its controller the output goes to zero, unless there is a stream to come back to."""
        if session is not self._owner:
            return
        if self.interrupt_stream():
            self._owner, self._locked, self._gone_at = None, False, time.monotonic()
        else:
            self._let_go()

    def resume(self) -> None:
        """The client of an interrupted stream has come back."""
        self._owner, self._gone_at = self._speaking, None

    def service(self) -> bool:
        """Talk to the clients, and watch over the generator."""
        moved = super().service()
        gone = self._gone_at
        if gone is not None and self._output_on and time.monotonic() - gone > self._watchdog_s:
            self._gone_at = None
            self._feed.halt(f"watchdog: no client for {self._watchdog_s:g} s, output to zero")
        return moved

    def interrupt_stream(self) -> bool:
        """Keep a stream for its client to come back to; whether there is one."""
        return False

    def end_stream(self) -> None:
        """End a stream, if there is one."""

    @command("SYSTem:LOCK:REQuest?")
    def _request_lock(self) -> bool:
        """Ask for control that lasts until it is released: 1 if it was given, 0 if another client has it."""
        try:
            self._take_control()
        except ScpiError:
            return False
        self._locked = True
        return True

    @command("SYSTem:LOCK:RELease")
    def _release_lock(self) -> None:
        """Give control up once nothing is in use any more; without it, leaving does."""
        if self._owner is self._speaking:
            self._locked = False

    @command("SYSTem:LOCK:OWNer?")
    def _lock_owner(self) -> str:
        """Address of the client that has control, in quotes; empty if nobody has."""
        return quoted(self._owner.name if self._owner is not None and self._in_use else "")

    @command("OUTPut:PROTection:WDOG:DELay", Number(minimum=0.1, maximum=60.0, unit="s"))
    def _set_watchdog(self, value: float) -> None:
        """How long the generator drives for a stream whose client has gone."""
        self._watchdog_s = value

    @command("OUTPut:PROTection:WDOG:DELay?")
    def _get_watchdog(self) -> float:
        """In s."""
        return self._watchdog_s

    @command("OUTPut:PROTection:TRIP", controls=False)
    def _trip(self) -> None:
        """Emergency stop, by any client: output to zero, streams end, nothing starts until it is cleared."""
        assert self._speaking is not None
        self._feed.halt(f"emergency stop by {self._speaking.name}", latched=True)

    @command("OUTPut:PROTection:TRIPped?")
    def _is_tripped(self) -> bool:
        """Whether an emergency stop holds; ACQuire:FAILure? says whose."""
        return self._feed.latched

    @command("OUTPut:PROTection:CLEar")
    def _clear_trip(self) -> None:
        """The cause of an emergency stop has gone."""
        self._feed.latched = False
