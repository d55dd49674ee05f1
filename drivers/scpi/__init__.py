"""SCPI and IEEE 488.2: messages, parameters with units, status registers, a declarative command table."""

from drivers.scpi.commands import Command, CommandTable, command
from drivers.scpi.errors import ErrorQueue, ScpiError
from drivers.scpi.instrument import Deferred, Instrument, Interpreter
from drivers.scpi.registers import Registers
from drivers.scpi.status import MEASURING, SAMPLES_LOST, StatusGroup
from drivers.scpi.values import Boolean, Choice, Integer, Number, definite_block, quoted

__all__ = [
    "MEASURING", "SAMPLES_LOST", "Boolean", "Choice", "Command", "CommandTable", "Deferred", "ErrorQueue",
    "Instrument", "Integer", "Interpreter", "Number", "Registers", "ScpiError", "StatusGroup", "command",
    "definite_block", "quoted",
]  # fmt: skip
