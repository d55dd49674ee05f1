"""An instrument behind ports: its conversations, and what the serving loop asks of it."""

from collections.abc import Sequence

from drivers.virtual.faults import LinkFaults
from drivers.virtual.ports import Port, TcpPort
from drivers.virtual.session import Session, Speaker

SESSIONS_LIMIT = 32
"""Clients at a time.  When one more comes, who has been silent longest goes, and first of those that never spoke."""
ACCEPTED_A_TURN = 8
"""So that a flood of connections does not keep the clients waiting that are there."""


class Conversing(Speaker):
    """What all SCPI instruments do with their lines; a subclass calls :meth:`attach` once."""

    name = ""
    idle_s = 300.0
    """How long a client may be silent before it is hung up: a person thinks, a dead program holds its place."""
    _sessions: list[Session]
    _listeners: list[TcpPort]
    _faults: LinkFaults

    def attach(self, ports: Sequence[Port | TcpPort], faults: LinkFaults | None) -> None:
        """Talk on these lines, with what goes wrong on them."""
        self._listeners = [port for port in ports if isinstance(port, TcpPort)]
        self._sessions = [Session(self, port) for port in ports if not isinstance(port, TcpPort)]
        self._faults = faults or LinkFaults()

    @property
    def stalled(self) -> bool:  # noqa: D102
        return self._faults.stalled

    def holds(self, session: Session) -> bool:
        """Whether a session must not make room for a newcomer."""
        return False

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
        for listener in self._listeners:
            self._accept(listener)
        moved = sum(session.service() for session in self._sessions) > 0
        for session in self._sessions:
            if session.silent_s > self.idle_s:
                (session.forget if session.port.returns else session.hang_up)()
        self._sessions = [session for session in self._sessions if not session.over]
        return moved

    def _accept(self, listener: TcpPort) -> None:
        for _ in range(ACCEPTED_A_TURN):
            line = listener.accept()
            if line is None:
                break
            if len(self._sessions) >= SESSIONS_LIMIT:
                may_go = [each for each in self._sessions if not each.port.returns and not self.holds(each)]
                if not may_go:
                    line.close()
                    break
                longest = max(may_go, key=lambda each: (not each.spoke, each.silent_s))
                longest.hang_up()
                self._sessions.remove(longest)
            self._sessions.append(Session(self, line))

    def descriptors(self) -> list[tuple[int, bool, bool]]:
        """What to wait for: descriptor, whether for input, whether for room."""
        if self._faults.away:
            return []
        waits = [wait for session in self._sessions for wait in session.descriptors()]
        return waits + [(listener.fileno(), True, False) for listener in self._listeners]

    def close(self) -> None:
        """Hang up everywhere."""
        for listener in self._listeners:
            listener.close()
        for session in self._sessions:
            session.port.close()
