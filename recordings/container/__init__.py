"""The file of a run: chunks, records and messages of MCAP, and what the recording contract makes of them."""

from recordings.container.assemble import Assembler
from recordings.container.collect import Collector
from recordings.container.interpret import Interpreter
