"""Host drivers: serial, TCP and CAN instruments, joined into one acquisition."""

from drivers.host.acquisition import RigAcquisition, StreamEndedError, open_instruments
from drivers.host.can_client import CanClient
from drivers.host.daq import DaqClient
from drivers.host.device import DeviceFailedError

__all__ = ["CanClient", "DaqClient", "DeviceFailedError", "RigAcquisition", "StreamEndedError", "open_instruments"]
