"""What a stranger's BLF file may do to its reader: the layers below the frames, checked before python-can reads them.

python-can trusts the sizes in a file: an object of size zero would keep it busy for ever, and a few bytes of zlib
unpack to gigabytes.  Layout as in python-can's own reader, after Lorenz' description of the format.
"""

import struct
import zlib
from pathlib import Path

from recordings.errors import InputError

UNPACKED_LIMIT_BYTES = 8 << 30
CONTAINER_LIMIT_BYTES = 64 << 20
OBJECT_LIMIT_BYTES = 1 << 20
_FILE_HEADER = struct.Struct("<4sL")
_FILE_HEADER_BYTES = 72
_OBJECT = struct.Struct("<4sHHLL")
_CONTAINER = struct.Struct("<H6xL4x")
_SMALLEST_OBJECT = _OBJECT.size + 16
_LOG_CONTAINER, _STORED, _DEFLATED = 10, 0, 2


def sound_length(path: Path, data: bytes) -> int:
    """Bytes of a BLF file that hold whole containers; the rest was cut off.

    Raises
    ------
    InputError
        With the place, if it is no BLF file, or a size in it makes no sense or is beyond the limits.
    """
    if len(data) < _FILE_HEADER_BYTES or data[:4] != b"LOGG":
        raise InputError(path, "", "is not a BLF file: it does not begin with LOGG and its header")
    _, at = _FILE_HEADER.unpack_from(data)
    if not _FILE_HEADER_BYTES <= at <= len(data):
        raise InputError(path, "header", f"claims a length of {at} bytes")
    unpacked = 0
    tail = b""
    while at < len(data):
        if len(data) - at < _OBJECT.size:
            return at
        signature, _, _, size, kind = _OBJECT.unpack_from(data, at)
        place = f"byte {at}"
        if signature != b"LOBJ" or size < _OBJECT.size:
            raise InputError(path, place, "no object of a BLF file begins here")
        if at + size > len(data):
            return at
        if kind == _LOG_CONTAINER:
            if size < _OBJECT.size + _CONTAINER.size:
                raise InputError(path, place, "a container shorter than its own head")
            inner = _unpack(path, place, data[at + _OBJECT.size : at + size])
            unpacked += len(inner)
            if unpacked > UNPACKED_LIMIT_BYTES:
                raise InputError(path, place, f"unpacks to more than {UNPACKED_LIMIT_BYTES} bytes, the limit")
            tail = _walk(path, place, tail + inner)
        at += size + size % 4
    return len(data)


def _unpack(path: Path, place: str, body: bytes) -> bytes:
    method, _ = _CONTAINER.unpack_from(body)
    content = body[_CONTAINER.size :]
    if method == _STORED:
        return content
    if method != _DEFLATED:
        raise InputError(path, place, f"compressed by method {method}, which is not known")
    try:
        inner = zlib.decompressobj().decompress(content, CONTAINER_LIMIT_BYTES + 1)
    except zlib.error as error:
        raise InputError(path, place, f"a damaged container ({error})") from error
    if len(inner) > CONTAINER_LIMIT_BYTES:
        raise InputError(path, place, f"a container of more than {CONTAINER_LIMIT_BYTES} bytes, the limit")
    return inner


def _walk(path: Path, place: str, data: bytes) -> bytes:
    """Check the objects of a container; what continues in the next one is given back."""
    at = 0
    while True:
        start = data.find(b"LOBJ", at, at + 8)
        if start < 0:
            if at + 8 > len(data):
                return data[at:]
            raise InputError(path, place, f"no object at byte {at} of the container")
        if start + _OBJECT.size > len(data):
            return data[at:]
        size = _OBJECT.unpack_from(data, start)[3]
        if not _SMALLEST_OBJECT <= size <= OBJECT_LIMIT_BYTES:
            raise InputError(path, place, f"an object of {size} bytes at byte {start} of the container")
        if start + size > len(data):
            return data[at:]
        at = start + size
