"""The protobuf messages of package ``rig``, built at run time: nothing to generate, nothing in the global pool.

The data of an MCAP schema is a ``FileDescriptorSet`` with ``google/protobuf/timestamp.proto`` before ``rig.proto``,
so any program that knows protobuf can decode the messages without this project.
"""

from functools import lru_cache
from typing import Any

from google.protobuf import descriptor_pb2, timestamp_pb2
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass

SAMPLE_BLOCK, STEP, EVENT, INDICATOR = "rig.SampleBlock", "rig.Step", "rig.Event", "rig.Indicator"
"""Full names of the four messages that stand on topics."""

SCHEMA_LIMIT_BYTES = 1 << 20

Field = descriptor_pb2.FieldDescriptorProto
_TYPES = {
    "double": Field.TYPE_DOUBLE,
    "float": Field.TYPE_FLOAT,
    "fixed64": Field.TYPE_FIXED64,
    "uint32": Field.TYPE_UINT32,
    "string": Field.TYPE_STRING,
    ".rig.Step.State": Field.TYPE_ENUM,
}
_TIMESTAMP = ("timestamp", ".google.protobuf.Timestamp")
_MESSAGES: dict[str, tuple[tuple[str, str], ...]] = {  # fields in order of their numbers, from 1
    "SampleBlock": (_TIMESTAMP, ("first_index", "fixed64"), ("sample_rate", "double"), ("series*", ".rig.Series")),
    "Series": (("channel", "string"), ("samples*", "float"), ("overload", "uint32")),
    "Step": (
        _TIMESTAMP, ("sweep", "string"), ("index", "uint32"), ("frequency", "double"),
        ("target_channel", "string"), ("target_amplitude", "double"), ("state", ".rig.Step.State"),
    ),
    "Event": (_TIMESTAMP, ("source", "string"), ("kind", "string"), ("detail", "string")),
    "Indicator": (_TIMESTAMP, ("value", "double"), ("unit", "string")),
}  # fmt: skip
_STATES = ("SETTLING", "MEASURING", "DONE", "ABORTED")


def _rig_file() -> descriptor_pb2.FileDescriptorProto:
    """``rig.proto`` as a descriptor."""
    file = descriptor_pb2.FileDescriptorProto(
        name="rig.proto", package="rig", syntax="proto3", dependency=["google/protobuf/timestamp.proto"]
    )
    for message_name, fields in _MESSAGES.items():
        message = file.message_type.add(name=message_name)
        for number, (name, kind) in enumerate(fields, start=1):
            field = message.field.add(
                name=name.rstrip("*"),
                number=number,
                type=_TYPES.get(kind, Field.TYPE_MESSAGE),
                label=Field.LABEL_REPEATED if name.endswith("*") else Field.LABEL_OPTIONAL,
            )
            if kind.startswith("."):
                field.type_name = kind
        if message_name == "Step":
            state = message.enum_type.add(name="State")
            for number, name in enumerate(_STATES):
                state.value.add(name=name, number=number)
    return file


def _timestamp_file() -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(file)
    return file


@lru_cache(maxsize=1)
def schema_data() -> bytes:
    """The ``FileDescriptorSet`` that every schema record of a run holds."""
    files = descriptor_pb2.FileDescriptorSet(file=[_timestamp_file(), _rig_file()])
    return files.SerializeToString(deterministic=True)


@lru_cache(maxsize=1)
def _pool() -> DescriptorPool:
    """A pool of our own: another package that also registers ``rig.Step`` must not clash with it."""
    pool = DescriptorPool()
    pool.Add(_timestamp_file())
    pool.Add(_rig_file())
    return pool


@lru_cache(maxsize=8)
def message_class(name: str) -> Any:
    """The protobuf class of a message by its full name, such as ``rig.Step``."""
    return GetMessageClass(_pool().FindMessageTypeByName(name))


@lru_cache(maxsize=64)
def schema_problem(name: str, data: bytes) -> str:
    """Why a schema found in a file is not the contract's message `name`; empty if it is.

    Further fields and messages are allowed; the contract's own must have their names, numbers and types, or bytes
    would be read as something they are not.
    """
    if len(data) > SCHEMA_LIMIT_BYTES:
        return f"schema of {len(data)} bytes, more than {SCHEMA_LIMIT_BYTES}"
    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(data)
    except DecodeError:
        return "schema is not a FileDescriptorSet"
    found = {f"{file.package}.{message.name}": message for file in files.file for message in file.message_type}
    wanted = {f"rig.{message.name}": message for message in _rig_file().message_type}
    if name not in found:
        return f"schema does not define {name}"
    for part in [name, "rig.Series"] if name == SAMPLE_BLOCK else [name]:
        if part not in found:
            return f"schema does not define {part}"
        fields = {field.number: field for field in found[part].field}
        for field in wanted[part].field:
            other = fields.get(field.number)
            same = other is not None and (other.name, other.type, other.label, other.type_name) == (
                field.name, field.type, field.label, field.type_name,
            )  # fmt: skip
            if not same:
                return f"schema's field {field.number} of {part} is not {field.name!r} as in the contract"
    return ""
