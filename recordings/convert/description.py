"""Everything of a run but its samples as plain data for JSON, for formats that have a place for text."""

import base64
import binascii
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from recordings.container.metadata import channel_record, parse_channel, parse_run
from recordings.run import Channel, DeviceSamples, Event, Indicator, Run, Step, StepState

Time = Field(ge=0, lt=1 << 63)


class _Model(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)


class _Device(_Model):
    device: str
    sample_rate_Hz: float
    channels: list[str]
    overload: dict[str, int] = {}


class _Step(_Model):
    time_ns: int = Time
    sweep: str
    index: int = Field(ge=0, lt=1 << 32)
    frequency_Hz: float = Field(ge=0)
    target_channel: str
    target_amplitude: float = Field(ge=0)
    state: int = Field(ge=0, le=3)


class _Event(_Model):
    time_ns: int = Time
    source: str
    kind: str
    detail: str = ""


class _Indicator(_Model):
    name: str
    time_ns: int = Time
    value: float
    unit: str = ""


class _Description(_Model):
    run: dict[str, str]
    channels: dict[str, dict[str, str]]
    devices: list[_Device]
    steps: list[_Step] = []
    events: list[_Event] = []
    indicators: list[_Indicator] = []
    attachments: dict[str, str] = {}


@dataclass(frozen=True, kw_only=True)
class Description:
    """A run without its samples; `devices` is rate, channels and overload by name."""

    info: dict[str, str]
    channels: dict[str, Channel]
    devices: dict[str, tuple[float, list[str], dict[str, int]]]
    steps: tuple[Step, ...]
    events: tuple[Event, ...]
    indicators: tuple[Indicator, ...]
    attachments: dict[str, bytes]

    def run(self, path: str, devices: Mapping[str, DeviceSamples]) -> Run:
        """The run, with its samples."""
        return Run(
            path=path, info=self.info, channels=self.channels, devices=devices, steps=self.steps,
            events=self.events, indicators=self.indicators, attachments=self.attachments,
        )  # fmt: skip


def describe(run: Run) -> dict[str, Any]:
    """Plain data that `parse_description` understands."""
    return {
        "run": dict(run.info),
        "channels": {name: channel_record(channel) for name, channel in run.channels.items()},
        "devices": [
            {
                "device": name, "sample_rate_Hz": device.sample_rate_Hz, "channels": list(device.values),
                "overload": {channel: int(count) for channel, count in device.overload.items()},
            }
            for name, device in run.devices.items()
        ],
        "steps": [{**asdict(step), "state": int(step.state)} for step in run.steps],
        "events": [asdict(event) for event in run.events],
        "indicators": [asdict(indicator) for indicator in run.indicators],
        "attachments": {name: base64.b64encode(data).decode() for name, data in run.attachments.items()},
    }  # fmt: skip


def parse_description(data: object) -> Description:
    """Check plain data from a stranger's file.

    Raises
    ------
    ValueError
        With place and reason.
    """
    try:
        found = _Description.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"{'.'.join(str(part) for part in first['loc'])!r:.80}: {first['msg']}") from error
    channels = {name: parse_channel(name, record) for name, record in found.channels.items()}
    devices = {each.device: (each.sample_rate_Hz, each.channels, each.overload) for each in found.devices}
    for name, (_, names, overload) in devices.items():
        for channel in names:
            if channel not in channels or channels[channel].device != name:
                raise ValueError(f"channel {channel!r:.80} of device {name!r:.80} is not described")
        if any(count < 0 for count in overload.values()):
            raise ValueError(f"a negative overload of device {name!r:.80}")
    try:
        attachments = {name: base64.b64decode(text, validate=True) for name, text in found.attachments.items()}
    except binascii.Error as error:
        raise ValueError(f"attachments: not base64: {error}") from error
    return Description(
        info=parse_run(found.run), channels=channels, devices=devices, attachments=attachments,
        steps=tuple(Step(**{**step.model_dump(), "state": StepState(step.state)}) for step in found.steps),
        events=tuple(Event(**event.model_dump()) for event in found.events),
        indicators=tuple(Indicator(**indicator.model_dump()) for indicator in found.indicators),
    )  # fmt: skip
