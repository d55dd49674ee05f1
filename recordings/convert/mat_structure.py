"""The structure of a MATLAB 5 file, walked before scipy reads it.

scipy looks types of data up without asking whether there is such a type, and a damaged file takes the whole program
down; and a few compressed bytes can claim gigabytes.
"""

from __future__ import annotations

import struct
import zlib
from typing import BinaryIO, Protocol

_HEADER_BYTES = 128
_ORDERS = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
"""Version and byte order at the end of the header."""
_MATRIX, _COMPRESSED = 14, 15
_FLAGS, _DIMENSIONS, _NAME = 6, 5, 1
_COMPLEX = 0x800
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13))
_TEXT = frozenset((1, 2, 4, 16, 17, 18))
_CLASSES = {4: _TEXT, **dict.fromkeys(range(6, 16), _NUMBERS)}
"""Text, double, single and whole numbers, by number, and the types of data that may stand behind them."""
_OTHERS = {1: "cell", 2: "struct", 3: "object", 5: "sparse", 16: "function", 17: "opaque"}
_PIECE_BYTES = 1 << 20
_HEAD_LIMIT_BYTES = 4096
"""Dimensions and names are short."""


def check_structure(stream: BinaryIO, *, limit_bytes: int) -> None:
    """Walk through all variables, unpacking what is compressed and keeping nothing of it.

    Raises
    ------
    ValueError
        With the reason, if it is no MATLAB 5 file of plain arrays and texts, or holds more than `limit_bytes`.
    """
    header = stream.read(_HEADER_BYTES)
    order = _ORDERS.get(header[-4:])
    if len(header) < _HEADER_BYTES or order is None:
        raise ValueError("not a MATLAB 5 file")
    left_bytes = limit_bytes
    while head := stream.read(8):
        if len(head) < 8:
            raise ValueError("the file ends within a variable")
        kind, length = struct.unpack(f"{order}II", head)
        if kind not in (_MATRIX, _COMPRESSED):
            raise ValueError(f"a variable of type {kind}")
        source: _Source = _Plain(stream, length)
        if kind == _COMPRESSED:
            source = _Unpacked(source, left_bytes)
            kind, length = struct.unpack(f"{order}II", _exactly(source, 8))
            if kind != _MATRIX:
                raise ValueError(f"a compressed variable of type {kind}")
        left_bytes -= length
        if left_bytes < 0:
            raise ValueError(f"it holds more than {limit_bytes} bytes")
        _check_variable(source, length, order)
        source.finish()


def _check_variable(source: _Source, length: int, order: str) -> None:
    """Flags, dimensions, name and data of one variable, and nothing more."""
    used = 0
    heads = []
    for wanted in (_FLAGS, _DIMENSIONS, _NAME):
        kind, size, padded, small = _tag(source, order)
        if kind != wanted or size > _HEAD_LIMIT_BYTES:
            raise ValueError(f"a variable's head of type {kind} and {size} bytes")
        heads.append(small if small else _exactly(source, padded)[:size])
        used += 8 + (0 if small else padded)
    if len(heads[0]) != 8:
        raise ValueError("a variable's flags are cut")
    (flags,) = struct.unpack_from(f"{order}I", heads[0])
    types = _CLASSES.get(flags & 0xFF)
    if types is None or flags & _COMPLEX:
        kind_of_class = "complex" if types is not None else _OTHERS.get(flags & 0xFF, str(flags & 0xFF))
        raise ValueError(f"a variable is of class {kind_of_class}, which a run does not have")
    kind, _, padded, small = _tag(source, order)
    if kind not in types:
        raise ValueError(f"a variable with data of type {kind}")
    used += 8 + (0 if small else padded)
    if used != length:
        raise ValueError(f"a variable of {length} bytes with {used} bytes in it")
    if not small:
        source.skip(padded)


def _tag(source: _Source, order: str) -> tuple[int, int, int, bytes]:
    """Type, bytes, bytes with padding, and the data themselves where they are small and stand in the tag."""
    raw = _exactly(source, 8)
    word, size = struct.unpack(f"{order}II", raw)
    if word >> 16:
        if word >> 16 > 4:
            raise ValueError("a small element of more than four bytes")
        return word & 0xFFFF, word >> 16, 0, raw[4 : 4 + (word >> 16)]
    return word, size, size + -size % 8, b""


class _Source(Protocol):
    """Bytes of one variable."""

    def read(self, count: int) -> bytes:
        """The next bytes; fewer at the end."""
        ...

    def skip(self, count: int) -> None:
        """Leave bytes out; raises ValueError if there are fewer."""
        ...

    def finish(self) -> None:
        """Go to the end of the variable in the file."""
        ...


def _exactly(source: _Source, count: int) -> bytes:
    data = source.read(count)
    if len(data) < count:
        raise ValueError("a variable is cut short")
    return data


class _Plain:
    """A stretch of the file."""

    def __init__(self, stream: BinaryIO, length: int) -> None:
        self._stream, self._left = stream, length

    def read(self, count: int) -> bytes:
        data = self._stream.read(min(count, self._left))
        self._left -= len(data)
        return data

    def skip(self, count: int) -> None:
        while count:
            count -= len(_exactly(self, min(count, _PIECE_BYTES)))

    def finish(self) -> None:
        self.skip(self._left)


class _Unpacked:
    """A compressed stretch of the file, unpacked piece by piece."""

    def __init__(self, packed: _Source, limit_bytes: int) -> None:
        self._packed, self._left_bytes = packed, limit_bytes
        self._unpacker = zlib.decompressobj()
        self._buffer = bytearray()

    def read(self, count: int) -> bytes:
        try:
            while len(self._buffer) < count and not self._unpacker.eof:
                piece = self._unpacker.unconsumed_tail or self._packed.read(_PIECE_BYTES)
                if not piece:
                    break
                data = self._unpacker.decompress(piece, _PIECE_BYTES)
                self._left_bytes -= len(data)
                if self._left_bytes < 0:
                    raise ValueError("its compressed variables hold more than the limit")
                self._buffer += data
        except zlib.error as error:
            raise ValueError("compressed data are damaged") from error
        taken = bytes(self._buffer[:count])
        del self._buffer[:count]
        return taken

    def skip(self, count: int) -> None:
        while count:
            count -= len(_exactly(self, min(count, _PIECE_BYTES)))

    def finish(self) -> None:
        if self.read(1) or not self._unpacker.eof:
            raise ValueError("a compressed variable holds more or less than it says")
        self._packed.finish()
