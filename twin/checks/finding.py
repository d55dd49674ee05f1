"""What a first look at recordings saw."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from recordings.errors import InputError, printable

Action = Literal["stopped", "set aside", "told"]

REMEDIES = {
    "across": "its fits go without it; turn the sensor to measure with it",
    "aliasing": "record with an anti-aliasing filter, or at a higher rate",
    "clock": "correct the file's time stamps or its sample rates",
    "dead": "check cable and supply",
    "direction": "correct the channel's direction in the recording or in the rig file",
    "empty": "check cable and supply",
    "few": "measure more steps",
    "name": "give the channel the name that the rig has for it",
    "overflow": "choose a larger range, or read the file's numbers as they were written",
    "position": "correct the one that is wrong",
    "preload": "give the right --preload, or correct the recording's",
    "quantity": "correct the recording's label, or the rig file's sensor",
    "range": "correct the channel's range in the recording",
    "rig": "give the --rig that was recorded",
    "same": "give each run and each channel once, and hold out what no fit sees",
    "specimen": "take the runs of each specimen by themselves",
    "step": "correct the steps' frequencies or times",
    "swapped": "give each channel the name that the rig has for it",
    "target": "correct the steps' target channel",
    "unit": "record in SI, or convert the file",
    "unrelated": "give channels that were recorded together",
    "wild": "",
}
"""What to do about each kind."""


@dataclass(frozen=True)
class Finding:
    """One thing that is not as it should be."""

    run: str
    """The recording's file."""
    channel: str
    """Empty where it is not one channel's."""
    kind: str
    """One of those in the guide, such as ``unit`` or ``swapped``."""
    expected: str
    found: str
    """What the rig, the file or its other runs say, and what the samples say."""
    action: Action
    """``stopped``: no fit is begun.  ``set aside``: what is faulty is not used.  ``told``: nothing else is done."""

    @property
    def line(self) -> str:
        """All of it in one line, with what to do."""
        return printable(str(self._as_error(Path(self.run).name)))

    def refusal(self) -> InputError:
        """The error that ends a command."""
        return self._as_error(self.run)

    def _as_error(self, source: str) -> InputError:
        place = f"channel {self.channel}" if self.channel else ""
        aside = " (set aside)" if self.action == "set aside" else ""
        reason = f"{self.kind}: {self.found}{aside}; expected {self.expected}"
        return InputError(source, place, reason, REMEDIES[self.kind])
