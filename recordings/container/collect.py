"""Gathering the items of one file, and what must agree between them."""

from collections.abc import Callable

from recordings.container.assemble import Assembler
from recordings.container.interpret import Item, MessageItem, MetadataItem, Problem
from recordings.container.metadata import RUN
from recordings.container.stored import Loader
from recordings.limits import Limits
from recordings.run import Channel, Event, Indicator, SampleBlock, Step


class Collector:
    """Takes items one by one; what breaks the contract is reported, and left out if the report does not raise.

    Parameters
    ----------
    limits
        What may be kept.
    report
        Called with each problem.
    load
        Gives sample blocks again, which are not kept.
    """

    def __init__(self, limits: Limits, report: Callable[[Problem], None], load: Loader) -> None:
        self._limits, self._report, self._load = limits, report, load
        self._metadata: dict[str, dict[str, str]] = {}
        self._device_of: dict[str, str] = {}
        self._full = False
        self._values = 0
        self.info: dict[str, str] = {}
        self.channels: dict[str, Channel] = {}
        self.attachments: dict[str, bytes] = {}
        self.assemblers: dict[str, Assembler] = {}
        self.steps: list[Step] = []
        self.events: list[Event] = []
        self.indicators: list[Indicator] = []

    def take(self, item: Item) -> bool:
        """Take an item; False if it broke the contract in a way that the interpreter could not see."""
        if isinstance(item, MetadataItem):
            return self._take_metadata(item)
        if not isinstance(item, MessageItem):
            if self.attachments.setdefault(item.name, item.data) != item.data:
                return self._breach(f"attachment {item.name!r:.80}", "is given twice with different content")
            return True
        content = item.content
        if isinstance(content, SampleBlock):
            return self._block(content, item)
        if isinstance(content, Step):
            self.steps.append(content)
        elif isinstance(content, Event):
            self.events.append(content)
        elif isinstance(content, Indicator):
            self.indicators.append(content)
        return True

    def finish(self) -> None:
        """Report what only the whole file can tell."""
        if RUN not in self._metadata:
            self._breach("metadata 'run'", "is missing")
        for name, device in self._device_of.items():
            channel = self.channels.get(name)
            place = f"metadata {f'channel/{name}'!r:.80}"
            if channel is None:
                if f"channel/{name}" not in self._metadata:  # one that broke the contract has been reported
                    self._breach(place, f"is missing, though device {device!r:.80} has the channel")
            elif channel.device != device:
                self._breach(place, f"says device {channel.device!r:.80}, its samples are of {device!r:.80}")

        for device, assembler in self.assemblers.items():
            try:
                assembler.layout()
            except ValueError as error:
                self._breach(f"topic {f'/samples/{device}'!r:.80}", str(error))

    def _breach(self, place: str, reason: str) -> bool:
        self._report(Problem(kind="contract", place=place, reason=reason))
        return False

    def _take_metadata(self, item: MetadataItem) -> bool:
        if self._metadata.setdefault(item.name, item.record) != item.record:
            return self._breach(f"metadata {item.name!r:.80}", "is given twice with different content")
        if isinstance(item.content, Channel):
            self.channels[item.content.name] = item.content
        elif item.content is not None:
            self.info = item.content
        return True

    def _block(self, block: SampleBlock, item: MessageItem) -> bool:
        place = item.place
        for name in block.samples:
            if self._device_of.setdefault(name, block.device) != block.device:
                other = self._device_of[name]
                return self._breach(place, f"channel {name!r:.80} is also one of device {other!r:.80}")
        if len(self._device_of) > self._limits.records:
            return self._over(place, f"more than {self._limits.records} channels, the limit of this program")
        if self._values > self._limits.values:
            return self._over(place, f"more than {self._limits.values} samples, the limit of this program")
        assembler = self.assemblers.setdefault(block.device, Assembler(block.device, self._limits, self._load))
        try:
            self._values += assembler.add(block, at=item.at)
        except ValueError as error:
            return self._breach(place, str(error))
        return True

    def _over(self, place: str, reason: str) -> bool:
        """A limit is reported once, however much follows."""
        if not self._full:
            self._breach(place, reason)
        self._full = True
        return False
