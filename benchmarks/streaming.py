"""Samples of the whole rig, four channels with noise and converter, over real time."""

from benchmarks.measured import Measured, least_seconds
from benchmarks.step_error import VOLTS, FREQUENCY_Hz, RATE_Hz, step_error
from recordings.streams import Excitation
from twin.bench import BenchSetup, open_bench
from twin.rigs import load_rig

CHUNK = 1 << 14


def streaming() -> Measured:
    """The error is that of one step a sample."""
    bench = open_bench(load_rig("steel-lap-joint"), sample_rate_Hz=RATE_Hz, setup=BenchSetup(monitors=("voltage",)))
    bench.set_output(Excitation(kind="sine", amplitude_V=VOLTS, frequency_Hz=FREQUENCY_Hz))
    seconds = least_seconds(lambda: bench.read(CHUNK), 300)
    return Measured(
        ratio=CHUNK / RATE_Hz / seconds, promise=150, against="real time at 25.6 kHz", error=step_error(),
        more={"channels": len(bench.channels)},
    )  # fmt: skip
