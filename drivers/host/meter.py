"""Host side of a slow meter: asked now and then, in a thread of its own, so that it holds nobody up."""

import threading
from collections.abc import Mapping, Sequence

from drivers.host.catalogue import read_catalogue, read_identity
from drivers.host.device import Mailbox, configure_channels
from drivers.host.text_line import ask_line, drain
from drivers.host.transport import LineLostError, Transport, open_transport
from drivers.instruments import DeviceSettings
from recordings.errors import InputError
from recordings.run import Channel, Indicator

OVERRANGE = 9.9e37
"""SCPI's value for what is beyond the range; 9.91E37 is not a number."""
RETRY_S = 1.0


class MeterClient:
    """A meter whose values become indicators.

    It is not needed for a run: where it falls silent that is an event, and it is looked for again.

    Parameters
    ----------
    settings
        Of the device, from the instruments file.
    mailbox
        Where events are noted.
    timeout_s
        Longest wait for an answer.

    Raises
    ------
    InputError
        If nothing answers at the address, or what does is no such instrument.
    """

    def __init__(self, settings: DeviceSettings, mailbox: Mailbox, *, timeout_s: float = 2.0) -> None:
        self.name = settings.name
        self.address = str(settings.parsed_address)
        self.interval_ns = round(settings.interval_s * 1e9)
        self._settings = settings
        self._mailbox = mailbox
        self._timeout_s = timeout_s
        self._line: Transport | None = self._open()
        self._indicators: list[Indicator] = []
        self._changed = threading.Condition()
        self._wanted_ns: int | None = None
        self._asked_ns: int | None = None
        self._stopping = False
        self._lost = False
        self._beyond: set[str] = set()
        self._thread: threading.Thread | None = None
        try:
            drain(self._line, timeout_s=timeout_s)
            self.identity = read_identity(self._ask)
            found = read_catalogue(self._ask, device=self.name)
            self.channels: Sequence[Channel]
            self.channels, wiring = configure_channels(found, settings.channel, device=self.name, source=self.address)
            factors = [1.0] * len(wiring.rows) if wiring.factors is None else wiring.factors[:, 0].tolist()
            self._wiring = list(zip(wiring.rows, factors, strict=True))
            self.first: Mapping[str, float] = self._read()
        except (LineLostError, TimeoutError, ValueError) as error:
            self.close()
            raise InputError(
                self.address, "", str(error), "is it the right port, the right baud rate, the instrument on?"
            ) from error
        except InputError:
            self.close()
            raise

    def _open(self) -> Transport:
        return open_transport(self._settings.parsed_address, baud=self._settings.baud, timeout_s=self._timeout_s)

    def _ask(self, text: str) -> str:
        if self._line is None:
            raise LineLostError("the line is closed")
        return ask_line(self._line, text, timeout_s=self._timeout_s)

    def _read(self) -> dict[str, float]:
        """Values by channel; raises ValueError if the answer is not understood."""
        answer = self._ask("READ?")
        values = [float(word) for word in answer.split(",")]
        if len(values) <= max(row for row, _ in self._wiring):
            raise ValueError(f"answers READ? with {answer[:60]!r}")
        found = {}
        for channel, (row, factor) in zip(self.channels, self._wiring, strict=True):
            if abs(values[row]) < OVERRANGE:
                found[channel.name] = values[row] * factor
                self._beyond.discard(channel.name)
            elif channel.name not in self._beyond:
                self._beyond.add(channel.name)
                self._mailbox.report(channel.name, "overload", "beyond the meter's range")
        return found

    def start(self) -> None:
        """From now on values are wanted."""
        self._stopping, self._wanted_ns, self._asked_ns = False, None, None
        self._indicators.clear()
        self._thread = threading.Thread(target=self._serve, name=f"reader of {self.name}", daemon=True)
        self._thread.start()

    def pass_time(self, now_ns: int) -> None:
        """Device time has come to `now_ns`: a value may be due.  Never waits."""
        if self._asked_ns is None or now_ns - self._asked_ns >= self.interval_ns:
            with self._changed:
                self._asked_ns = self._wanted_ns = now_ns
                self._changed.notify_all()

    def take(self) -> list[Indicator]:
        """Values since the last call, with the device time at which they were asked for."""
        with self._changed:
            taken, self._indicators = self._indicators, []
        return taken

    def stop(self) -> None:
        """No more values; never raises."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join(2 * self._timeout_s)
        self._thread = None

    def close(self) -> None:
        """Give the line up."""
        self.stop()
        if self._line is not None:
            self._line.close()
        self._line = None

    def _serve(self) -> None:
        """Body of the thread."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._wanted_ns is not None)
                if self._stopping:
                    return
                at_ns, self._wanted_ns = self._wanted_ns or 0, None
            try:
                values = self._read_again() if self._lost else self._read()
            except (LineLostError, TimeoutError, InputError, ValueError) as error:
                self._lose(str(error))
                continue
            with self._changed:
                for channel in self.channels:
                    if channel.name in values:
                        self._indicators.append(
                            Indicator(name=channel.name, time_ns=at_ns, value=values[channel.name], unit=channel.unit)
                        )

    def _lose(self, reason: str) -> None:
        if not self._lost:
            self._lost = True
            self._mailbox.report(self.name, "disconnected", reason)
        with self._changed:
            self._changed.wait_for(lambda: self._stopping, RETRY_S)

    def _read_again(self) -> dict[str, float]:
        """Look for a meter that was lost."""
        if self._line is not None:
            self._line.close()
        self._line = None
        self._line = self._open()
        drain(self._line, timeout_s=self._timeout_s)
        values = self._read()
        self._lost = False
        self._mailbox.report(self.name, "reconnected")
        return values
