"""A run in memory to MCAP."""

import heapq
from collections.abc import Iterator
from pathlib import Path

from recordings.convert.blocks import blocks_of
from recordings.run import Event, Indicator, Run, SampleBlock, Step
from recordings.writer import RunWriter


def write_mcap(run: Run, path: str | Path) -> list[str]:
    """Write all of a run to MCAP, in order of time; nothing is left behind."""
    streams: list[Iterator[SampleBlock | Step | Event | Indicator]] = [
        iter(run.steps), iter(run.events), iter(sorted(run.indicators, key=lambda value: value.time_ns)),
        *(blocks_of(device) for device in run.devices.values()),
    ]  # fmt: skip
    with RunWriter(
        path, info=run.info, channels=list(run.channels.values()), attachments=run.attachments
    ) as writer:  # fmt: skip
        for item in heapq.merge(*streams, key=lambda item: item.time_ns):
            if isinstance(item, SampleBlock):
                writer.write_block(item)
            elif isinstance(item, Step):
                writer.write_step(item)
            elif isinstance(item, Event):
                writer.write_event(item)
            else:
                writer.write_indicator(item)
    return []
