"""Small runs for tests: through our writer, and by an independent writer that follows the contract page alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from google.protobuf import descriptor_pb2, timestamp_pb2
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClassesForFiles
from google.protobuf.text_format import Parse
from mcap.writer import CompressionType, Writer

from recordings import Channel, RunWriter, SampleBlock, Step, StepState

START_NS = 1_700_000_000_000_000_000
RATE_Hz = 25600.0
CHANNELS = (
    Channel(name="force", quantity="force", unit="N", position_m=0.05, range=50.0),
    Channel(name="acc1", quantity="acceleration", unit="m/s^2", position_m=0.3, range=490.0, direction="-y"),
)
INFO = {"source": "simulated", "rig": "steel-lap-joint", "procedure": "stepped sine"}


def block_at(first_index: int, count: int = 256, *, seed: int = 0, device: str = "daq") -> SampleBlock:
    """Noise whose values depend on the sample number alone, so that any block can be checked by itself."""
    numbers = np.arange(first_index, first_index + count)
    return SampleBlock(
        device=device,
        time_ns=START_NS + round(first_index * 1e9 / RATE_Hz),
        first_index=first_index,
        sample_rate_Hz=RATE_Hz,
        samples={
            "force": np.sin(numbers * 0.7 + seed).astype(np.float32),
            "acc1": np.cos(numbers * 1.3 + seed).astype(np.float32),
        },
    )


def step_at(time_ns: int, state: StepState, *, index: int = 0, sweep: str = "up") -> Step:
    return Step(
        time_ns=time_ns, sweep=sweep, index=index, frequency_Hz=25.0 + index, target_channel="force",
        target_amplitude=1.5, state=state,
    )  # fmt: skip


def write_run(path: Path, blocks: int = 40, **options: object) -> Path:
    """A run of `blocks` blocks of 256 samples with one step."""
    with RunWriter(path, info=INFO, channels=CHANNELS, attachments={"rig.toml": b"x = 1\n"}, **options) as writer:
        writer.write_step(step_at(START_NS, StepState.SETTLING))
        for number in range(blocks):
            if number == blocks // 4:
                writer.write_step(step_at(block_at(number * 256).time_ns, StepState.MEASURING))
            writer.write_block(block_at(number * 256))
        writer.write_step(step_at(block_at(blocks * 256).time_ns, StepState.DONE))
    return path


# The contract page's messages in protobuf's own text form, typed in apart from recordings.container.schema.
FOREIGN_PROTO = """
name: "contract.proto" package: "rig" syntax: "proto3" dependency: "google/protobuf/timestamp.proto"
message_type { name: "SampleBlock"
  field { name: "timestamp" number: 1 label: LABEL_OPTIONAL type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" }
  field { name: "first_index" number: 2 label: LABEL_OPTIONAL type: TYPE_FIXED64 }
  field { name: "sample_rate" number: 3 label: LABEL_OPTIONAL type: TYPE_DOUBLE }
  field { name: "series" number: 4 label: LABEL_REPEATED type: TYPE_MESSAGE type_name: ".rig.Series" }
  field { name: "note" number: 90 label: LABEL_OPTIONAL type: TYPE_STRING } }
message_type { name: "Series"
  field { name: "channel" number: 1 label: LABEL_OPTIONAL type: TYPE_STRING }
  field { name: "samples" number: 2 label: LABEL_REPEATED type: TYPE_FLOAT }
  field { name: "overload" number: 3 label: LABEL_OPTIONAL type: TYPE_UINT32 } }
message_type { name: "Step"
  field { name: "timestamp" number: 1 label: LABEL_OPTIONAL type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" }
  field { name: "sweep" number: 2 label: LABEL_OPTIONAL type: TYPE_STRING }
  field { name: "index" number: 3 label: LABEL_OPTIONAL type: TYPE_UINT32 }
  field { name: "frequency" number: 4 label: LABEL_OPTIONAL type: TYPE_DOUBLE }
  field { name: "target_channel" number: 5 label: LABEL_OPTIONAL type: TYPE_STRING }
  field { name: "target_amplitude" number: 6 label: LABEL_OPTIONAL type: TYPE_DOUBLE }
  field { name: "state" number: 7 label: LABEL_OPTIONAL type: TYPE_ENUM type_name: ".rig.Step.State" }
  enum_type { name: "State" value { name: "SETTLING" number: 0 } value { name: "MEASURING" number: 1 }
              value { name: "DONE" number: 2 } value { name: "ABORTED" number: 3 } } }
message_type { name: "Event"
  field { name: "timestamp" number: 1 label: LABEL_OPTIONAL type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" }
  field { name: "source" number: 2 label: LABEL_OPTIONAL type: TYPE_STRING }
  field { name: "kind" number: 3 label: LABEL_OPTIONAL type: TYPE_STRING }
  field { name: "detail" number: 4 label: LABEL_OPTIONAL type: TYPE_STRING } }
message_type { name: "Indicator"
  field { name: "timestamp" number: 1 label: LABEL_OPTIONAL type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" }
  field { name: "value" number: 2 label: LABEL_OPTIONAL type: TYPE_DOUBLE }
  field { name: "unit" number: 3 label: LABEL_OPTIONAL type: TYPE_STRING } }
"""


class ForeignWriter:
    """An MCAP writer of the contract with google.protobuf and mcap alone; nothing of `recordings` is used.

    Tests change `run`, `channels` or single messages before or while writing, to break the contract on purpose.
    """

    def __init__(self, path: Path, *, compression: CompressionType = CompressionType.ZSTD, **options: object) -> None:
        timestamp = descriptor_pb2.FileDescriptorProto.FromString(timestamp_pb2.DESCRIPTOR.serialized_pb)
        rig = Parse(FOREIGN_PROTO, descriptor_pb2.FileDescriptorProto())
        pool = DescriptorPool()
        pool.Add(timestamp)
        pool.Add(rig)
        self.types = GetMessageClassesForFiles(["contract.proto"], pool)
        self.schema = descriptor_pb2.FileDescriptorSet(file=[rig, timestamp]).SerializeToString()
        self.run = {
            "format": "1", "source": "measured", "rig": "r", "procedure": "p", "started": "2026-01-01T00:00:00Z",
        }  # fmt: skip
        self.channels = {
            "force": {
                "quantity": "force", "unit": "N", "position_m": "0.05", "direction": "+y", "range": "50",
                "device": "daq",
            },
            "acc1": {
                "quantity": "acceleration", "unit": "m/s^2", "position_m": "0.3", "direction": "-y", "range": "490",
                "device": "daq", "serial": "4711",
            },
        }  # fmt: skip
        self.path = path
        self.stream = path.open("wb")
        self.writer = Writer(self.stream, compression=compression, **options)
        self.writer.start()
        self.ids: dict[str, int] = {}

    def message(self, topic: str, kind: str, time_ns: int, /, **fields: object) -> None:
        content = self.types[f"rig.{kind}"](**fields)
        content.timestamp.seconds, content.timestamp.nanos = divmod(time_ns, 1_000_000_000)
        self.raw(topic, f"rig.{kind}", max(time_ns, 0), content.SerializeToString())

    def block(self, block: SampleBlock, **changes: object) -> None:
        series = [
            self.types["rig.Series"](channel=name, samples=values.tolist(), overload=block.overload.get(name, 0))
            for name, values in block.samples.items()
        ]
        fields = {"first_index": block.first_index, "sample_rate": block.sample_rate_Hz, "series": series, **changes}
        time_ns = fields.pop("time_ns", block.time_ns)
        self.message(f"/samples/{block.device}", "SampleBlock", time_ns, **fields)

    def raw(self, topic: str, schema: str, time_ns: int, data: bytes, encoding: str = "protobuf") -> None:
        if topic not in self.ids:
            number = self.writer.register_schema(schema, "protobuf", self.schema)
            self.ids[topic] = self.writer.register_channel(topic, encoding, number)
        self.writer.add_message(self.ids[topic], log_time=time_ns, publish_time=time_ns, data=data)

    def finish(self) -> Path:
        self.writer.add_metadata("run", self.run)
        for name, record in self.channels.items():
            self.writer.add_metadata(f"channel/{name}", record)
        self.writer.add_metadata("weather", {"sky": "blue"})
        self.writer.finish()
        self.stream.close()
        return self.path
