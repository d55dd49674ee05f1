"""What is done with a rig: procedures as data, and the one loop that runs them on virtual and real hardware."""

from twin.procedures.direct import DirectAcquisition
from twin.procedures.grid import planned_steps
from twin.procedures.kinds import Dwell, Impact, Multisine, Procedure, Random, RingDown, SteppedSine, SweptSine
from twin.procedures.recorder import RunSink
from twin.procedures.results import ProcedureResult, StepResult
from twin.procedures.run import check_channels, check_rate, run_procedure
from twin.procedures.store import PROCEDURE_FILES, dump_procedure, load_procedure, parse_procedure, save_procedure

__all__ = [
    "PROCEDURE_FILES", "DirectAcquisition", "Dwell", "Impact", "Multisine", "Procedure", "ProcedureResult",
    "Random", "RingDown", "RunSink", "StepResult", "SteppedSine", "SweptSine", "check_channels", "check_rate",
    "dump_procedure", "load_procedure", "parse_procedure", "planned_steps", "run_procedure", "save_procedure",
]  # fmt: skip
