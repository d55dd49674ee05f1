"""How much memory a recording's length costs where it is simulated, checked, reduced and read for a replay."""

import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from recordings import RunWriter, read_run

LENGTHS_s = (60, 600)
"""Of the noise; what both need beside the samples falls out of the slope, and the latest samples, which are kept."""
HOUR_s = 3600
PROMISED_MB = 300.0
PROCEDURE = """procedure = "random"
target_channel = "force"
band = [5.0, 1000.0]
rms = 0.5
duration = {seconds}
sample_rate = 25600.0
"""
COMMAND = "import runpy, sys; sys.argv[1:] = {}; runpy.run_module('twin', run_name='__main__')"
STAGES = {
    "simulated and recorded": "from benchmarks.memory import record; record()",
    "checked": COMMAND.format(["check", "run.mcap"]),
    "reduced": COMMAND.format(["modes", "run.mcap"]),
    "opened for a replay": "from benchmarks.memory import open_for_replay; open_for_replay()",
}
AND_TELL = """
import atexit, pathlib
def tell():
    status = pathlib.Path("/proc/self/status").read_text()
    pathlib.Path("peak").write_text(status.split("VmHWM:")[1].split()[0])
atexit.register(tell)
"""
"""The most memory the process ever had, kB; what wait4 tells of a child holds its parent's too."""


@dataclass(frozen=True)
class Memory:
    """The largest memory of one stage at :data:`LENGTHS_s`, in MB, and what that makes of an hour."""

    stage: str
    shorter_MB: float
    longer_MB: float

    @property
    def hour_MB(self) -> float:
        """Along the straight line through both."""
        short, long = LENGTHS_s
        return self.shorter_MB + (self.longer_MB - self.shorter_MB) * (HOUR_s - short) / (long - short)

    def table(self) -> dict[str, Any]:
        """All figures, and whether the promise for an hour holds."""
        return asdict(self) | {"hour_MB": self.hour_MB, "held": self.hour_MB <= PROMISED_MB}


def record() -> None:
    """Simulate ``noise.toml`` on the steel rig and record it as ``run.mcap``."""
    from twin.bench import BenchSetup, open_bench
    from twin.procedures import DirectAcquisition, load_procedure, run_procedure
    from twin.rigs import load_rig

    setup = BenchSetup(monitors=("voltage",))
    bench = open_bench(load_rig("steel-lap-joint"), sample_rate_Hz=25600.0, setup=setup)
    with RunWriter("run.mcap", info={"source": "simulated"}, channels=list(bench.channels)) as writer:
        run_procedure(load_procedure("noise.toml"), DirectAcquisition(bench), writer)


def open_for_replay() -> None:
    """Open ``run.mcap`` as a replay does."""
    from drivers.virtual.recorded import RecordedSource

    RecordedSource(read_run("run.mcap"))


def memory_over_length() -> list[Memory]:
    """Each stage of a recording of the steel rig, four channels at 25.6 kHz, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        found = [peaks_MB(Path(folder) / str(seconds), seconds) for seconds in LENGTHS_s]
    return [Memory(stage, *(peaks[stage] for peaks in found)) for stage in STAGES]


def peaks_MB(folder: Path, seconds: int) -> dict[str, float]:
    """MB of each stage with so many seconds of noise, recorded in a new folder."""
    folder.mkdir()
    (folder / "noise.toml").write_text(PROCEDURE.format(seconds=seconds), encoding="utf-8")
    peaks = {}
    for stage, code in STAGES.items():
        done = subprocess.run(
            [sys.executable, "-c", AND_TELL + code], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        if done.returncode not in (0, 1):  # 1 is an answer too
            raise RuntimeError(f"{stage}: exit status {done.returncode}")
        peaks[stage] = int((folder / "peak").read_text(encoding="utf-8")) / 1024
    return peaks
