"""Samples in memory to blocks and back, for formats that keep arrays instead of blocks."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from recordings.container.assemble import Assembler
from recordings.limits import Limits
from recordings.run import DeviceSamples, SampleBlock

BLOCK_SAMPLES = 4096
TIME_STEP_NS = 2
"""Time stamps that stray less than this from even spacing, after rounding, belong to one block."""


def blocks_of(device: DeviceSamples) -> Iterator[SampleBlock]:
    """The blocks that a device's samples came in, without the NaN that stand for lost samples.

    The overload of a channel, which is only known as a whole, is given to the first blocks that can hold it.
    """
    left = dict(device.overload)
    gaps = list(device.gaps)
    number = device.first_index
    starts = [int(start) for start in device.block_start]
    for index, (start, stop) in enumerate(zip(starts, [*starts[1:], len(device)], strict=True)):
        lost = 0
        if gaps and gaps[0].first_index < number + stop - start:
            lost = gaps[0].count
            stop = start + gaps.pop(0).first_index - number
        overload = {name: min(left.get(name, 0), stop - start) for name in device.values}
        for name, count in overload.items():
            left[name] = left.get(name, 0) - count
        yield SampleBlock(
            device=device.device, time_ns=int(device.block_time_ns[index]), first_index=number,
            sample_rate_Hz=device.sample_rate_Hz, overload=overload,
            samples={name: values[start:stop] for name, values in device.values.items()},
        )  # fmt: skip
        number += stop - start + lost


def to_float32(values: NDArray[np.float64] | NDArray[np.float32]) -> NDArray[np.float32]:
    """Values as a recording keeps them.

    Raises
    ------
    ValueError
        If one is finite but beyond float32: infinity would be a silently wrong number.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        single = values.astype(np.float32)
    if np.any(np.isinf(single) & np.isfinite(values)):
        raise ValueError("a value is beyond the range of float32")
    return single


def device_from_rows(
    device: str,
    sample_rate_Hz: float,
    number: NDArray[np.int64],
    time_ns: NDArray[np.int64],
    values: Mapping[str, NDArray[np.float32]],
    overload: Mapping[str, int],
) -> DeviceSamples | None:
    """A device's samples from rows of number, time and values; missing numbers become gaps.

    Parameters
    ----------
    number, time_ns : shape (n,)
        Sample numbers and times of the rows.
    values
        Arrays of shape (n,) by channel.

    Raises
    ------
    ValueError
        With the reason, if the rows contradict each other.
    """
    if not len(number):
        return None
    assembler = Assembler(device, Limits())
    add_rows(assembler, device, sample_rate_Hz, number, time_ns, values, overload)
    return assembler.finish()


def add_rows(
    assembler: Assembler,
    device: str,
    sample_rate_Hz: float,
    number: NDArray[np.int64],
    time_ns: NDArray[np.int64],
    values: Mapping[str, NDArray[np.float32]],
    overload: Mapping[str, int],
) -> None:
    """Rows as of `device_from_rows`, at least one, as blocks to what collects those of the device.

    Raises
    ------
    ValueError
        With the reason, if the rows contradict each other or what was collected before.
    """
    if not np.isfinite(sample_rate_Hz) or sample_rate_Hz <= 0:
        raise ValueError(f"a sample rate of {sample_rate_Hz} Hz")
    if number[0] < 0 or np.any(number[1:] <= number[:-1]):
        raise ValueError("sample numbers do not rise")
    if time_ns.min() < 0:
        raise ValueError("a time before 1970")
    stray = np.diff(time_ns) - np.diff(np.rint((number - number[0]) * (1e9 / sample_rate_Hz)).astype(np.int64))
    breaks = 1 + np.flatnonzero((np.diff(number) != 1) | (np.abs(stray) > TIME_STEP_NS))
    left = dict(overload)
    for start, stop in zip([0, *breaks.tolist()], [*breaks.tolist(), len(number)], strict=True):
        for at in range(start, stop, BLOCK_SAMPLES):
            until = min(at + BLOCK_SAMPLES, stop)
            counts = {name: min(left.get(name, 0), until - at) for name in values}
            for name, count in counts.items():
                left[name] = left.get(name, 0) - count
            assembler.add(
                SampleBlock(
                    device=device, time_ns=int(time_ns[at]), first_index=int(number[at]),
                    sample_rate_Hz=sample_rate_Hz, overload=counts,
                    samples={name: series[at:until] for name, series in values.items()},
                )
            )  # fmt: skip
