"""An instrument behind ports: its conversations, and what the serving loop asks of it."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.scpi import Instrument, Interpreter
from drivers.virtual.faults import LinkFaults
from drivers.virtual.ports import Port
from drivers.virtual.session import Session

__all__ = ["Conversing"]


class Conversing(Instrument):
    """What all SCPI instruments do with their lines; a subclass calls :meth:`attach` once."""

    name = ""
    _sessions: Sequence[Session] = ()
    _faults: LinkFaults

    def attach(self, ports: Sequence[Port], faults: LinkFaults | None) -> None:
        """Talk on these lines, with what goes wrong on them."""
        self._sessions = [Session(self, port) for port in ports]
        self._faults = faults or LinkFaults()

    @property
    def stalled(self) -> bool:
        """Whether a fault keeps it from sending."""
        return self._faults.stalled

    def streams_to(self, session: Session) -> bool:
        """Whether a session's line carries frames instead of text."""
        return False

    def client_left(self, session: Session) -> None:
        """A client has hung up."""

    def converse(self, session: Session, interpreter: Interpreter) -> list[bytes]:
        """Run a client's commands."""
        return interpreter.run()

    def pass_time(self, time_s: float) -> None:
        """Device time goes on; a fault may hang up now, or take its power."""
        happens = self._faults.advance(time_s)
        if happens:
            for session in self._sessions:
                session.hang_up()
        if happens == "restart":
            self.reset()

    def service(self) -> bool:
        """Talk to the clients; whether anything moved."""
        if self._faults.away:
            return False
        return sum(session.service() for session in self._sessions) > 0

    def descriptors(self) -> list[tuple[int, bool]]:
        """What to wait for: descriptors, and whether to wait for room as well."""
        return [(session.port.fileno(), session.wants_to_write) for session in self._sessions]

    def close(self) -> None:
        """Hang up everywhere."""
        for session in self._sessions:
            session.port.close()
