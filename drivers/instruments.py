"""The instruments file: which device is where, and what hangs on its channels.

::

    [[device]]
    name = "daq"
    address = "serial:/dev/ttyUSB0"     # or tcp:HOST:PORT, can:INTERFACE:CHANNEL
    generator = true                    # exactly one device puts the drive signal out, and its clock is the reference

    [[device.channel]]                  # optional: all channels of the device, as it describes them, if left out
    source = "ai0"                      # the channel's name on the device
    name = "force"                      # its name in the recording
    quantity = "force"
    unit = "N"
    sensitivity = 0.0112                # device unit (V) per `unit`; left out, samples are taken as they are
    position_m = 0.05

    [[device]]
    name = "can"
    address = "can:socketcan:can0"
    bitrate = 1000000
    data_bitrate = 5000000
    frames = "fd"                       # "classic" for a node on a bus without CAN FD, which sends decimated samples
    node = 0                            # 1 for the second node of a bus
    start = "trigger"                   # "immediate" for a node without the trigger line

    [[device]]
    name = "meter"
    address = "serial:/dev/ttyUSB1"
    kind = "meter"                      # preload, temperature: asked now and then, recorded as indicators
    interval_s = 1.0                    # of the rig's time
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from drivers.addresses import Address, parse_address
from recordings.directions import Direction
from recordings.toml_input import read_toml

CALLED = r"[A-Za-z0-9_.-]{1,24}"
"""What a channel or a device may be called over an instrument's line."""
Name = Annotated[str, Field(pattern=f"^{CALLED}$")]


class ChannelSettings(BaseModel):
    """What hangs on a device's channel; what is left out is as the device says."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    source: Name
    name: Name | None = None
    quantity: str | None = None
    unit: str | None = None
    sensitivity: float | None = Field(default=None, allow_inf_nan=False)
    position_m: float | None = Field(default=None, allow_inf_nan=False)
    direction: Direction | None = None
    range: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @field_validator("sensitivity")
    @classmethod
    def _not_zero(cls, value: float | None) -> float | None:
        if value == 0.0:
            raise ValueError("a sensitivity of 0 says nothing about the quantity")
        return value


class DeviceSettings(BaseModel):
    """One device."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Name
    address: str
    kind: Literal["stream", "meter"] = "stream"
    generator: bool = False
    interval_s: float = Field(default=1.0, ge=0.1, le=3600.0, description="of a meter")
    start: Literal["trigger", "immediate"] = "trigger"
    baud: int = Field(default=921600, ge=300, le=20_000_000)
    bitrate: int = Field(default=1_000_000, ge=10_000, le=1_000_000)
    data_bitrate: int = Field(default=5_000_000, ge=10_000, le=8_000_000)
    frames: Literal["fd", "classic"] = "fd"
    node: int = Field(default=0, ge=0, le=1)
    channel: tuple[ChannelSettings, ...] = ()

    @field_validator("address")
    @classmethod
    def _readable(cls, value: str) -> str:
        parse_address(value)
        return value

    @model_validator(mode="after")
    def _meter_is_plain(self) -> DeviceSettings:
        if self.kind == "meter" and (self.generator or self.parsed_address.kind == "can"):
            raise ValueError("a meter is on a serial line or TCP, and has no generator")
        return self

    @property
    def parsed_address(self) -> Address:
        """The address in its parts."""
        return parse_address(self.address)


class Instruments(BaseModel):
    """All devices of a rig."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    device: tuple[DeviceSettings, ...] = Field(min_length=1, max_length=16)
    timeout_s: float = Field(default=2.0, gt=0.0, le=60.0, description="longest wait for an answer")
    reconnect_s: float = Field(default=10.0, ge=0.0, le=600.0, description="how long to look for a lost device")
    silence_s: float = Field(
        default=3.0, gt=0.0, le=600.0, description="how long a device may send nothing; a host may be deaf for a second"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Instruments:
        generators = [device for device in self.device if device.generator]
        if len(generators) != 1:
            raise ValueError(f"exactly one device has generator = true, here {len(generators)}")
        if generators[0].parsed_address.kind == "can":
            raise ValueError(f"device {generators[0].name}: a CAN node has no generator")
        for what, values in (
            ("name", [device.name for device in self.device]),
            ("address", [f"{device.parsed_address}, node {device.node}" for device in self.device]),
        ):
            twice = [value for value, count in Counter(values).items() if count > 1]
            if twice:
                raise ValueError(f"two devices have the {what} {twice[0]}")
        return self


def read_instruments(path: str | Path) -> Instruments:
    """Read an instruments file; raises recordings.errors.InputError with the field that is wrong."""
    return read_toml(path, Instruments)
