"""Virtual instruments: handed a source of samples, they speak on a serial line, TCP and CAN like hardware."""

from drivers.virtual.assembly import Addresses, Backing, VirtualRig
from drivers.virtual.can_node import CanNode
from drivers.virtual.control import Protection
from drivers.virtual.daq import AcquisitionInstrument
from drivers.virtual.faults import FaultPlan, parse_fault
from drivers.virtual.feed import SampleFeed
from drivers.virtual.meter import Meter
from drivers.virtual.ports import Port, PtyPort, SerialPort, TcpPort
from drivers.virtual.recorded import RecordedMeter, RecordedSource
from drivers.virtual.server import serve

__all__ = [
    "AcquisitionInstrument", "Addresses", "Backing", "CanNode", "FaultPlan", "Meter", "Port", "Protection",
    "PtyPort", "RecordedMeter", "RecordedSource", "SampleFeed", "SerialPort", "TcpPort", "VirtualRig",
    "parse_fault", "serve",
]  # fmt: skip
