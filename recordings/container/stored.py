"""Samples that stay in their file: decoded where they are asked for, a window at a time."""

from __future__ import annotations

import os
import threading
import weakref
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from recordings.container.chunks import chunk_data, message_at
from recordings.container.messages import Layout, decode_series
from recordings.container.records import CHUNK_HEAD_BYTES, HEAD, chunk_head
from recordings.errors import InputError
from recordings.limits import Limits
from recordings.run import Samples

Series = Mapping[str, NDArray[np.float32]]


class Loader(Protocol):
    """What gives the samples of a block again, by the place where it was found."""

    def __call__(self, chunk: int, position: int, /) -> Series:
        """Samples by channel, all of one length."""
        ...


class BlockStore:
    """The sample blocks of one file, decoded again where they are needed; the latest of them are kept.

    It reads by offsets, so that the file may be read by others too, be renamed, and lose its name.

    Parameters
    ----------
    path
        For errors, and for another process to open.
    stream
        The file.
    limits
        `held_samples` bounds what is kept.
    """

    def __init__(self, path: Path, stream: BinaryIO, limits: Limits) -> None:
        self._path, self._stream, self._limits = path, stream, limits
        self._kept: OrderedDict[tuple[int, int], Series] = OrderedDict()
        self._kept_samples = 0
        self._data: tuple[int, bytes] = (-1, b"")
        self._layouts: dict[int, Layout] = {}
        self._lock = threading.Lock()

    @classmethod
    def owning(cls, path: Path, stream: BinaryIO, limits: Limits) -> BlockStore:
        """A store that closes its file when nobody needs it any more."""
        store = cls(path, stream, limits)
        weakref.finalize(store, stream.close)
        return store

    def __reduce__(self) -> tuple[Any, ...]:
        return _opened, (self._path, self._limits)

    def keep(self, chunk: int, position: int, series: Series) -> None:
        """Remember what was just decoded."""
        with self._lock:
            self._keep((chunk, position), series)

    def __call__(self, chunk: int, position: int, /) -> Series:
        """The samples of the block at a position among the records of the chunk at an offset; -1: of no chunk.

        Raises
        ------
        InputError
            If it is not there any more.
        """
        with self._lock:
            found = self._kept.get((chunk, position))
            if found is not None:
                self._kept.move_to_end((chunk, position))
                return found
            try:
                found = decode_series(self._message(chunk, position), self._layouts)
            except (OSError, ValueError) as error:
                place, remedy = f"chunk at byte {chunk}", "read it again when nobody writes to it"
                raise InputError(self._path, place, f"changed after it was read: {error}", remedy) from error
            self._keep((chunk, position), found)
            return found

    def _keep(self, at: tuple[int, int], series: Series) -> None:
        self._kept[at] = series
        self._kept_samples += _size(series)
        while self._kept_samples > self._limits.held_samples and len(self._kept) > 1:
            self._kept_samples -= _size(self._kept.popitem(last=False)[1])

    def _message(self, chunk: int, position: int) -> bytes:
        if position < 0:
            _, length = HEAD.unpack(self._read(chunk, HEAD.size))
            return message_at(self._read(chunk, HEAD.size + length), 0)
        if self._data[0] != chunk:
            found = chunk_head(BytesIO(self._read(chunk, CHUNK_HEAD_BYTES)), 0, self._limits)
            if found is None:
                raise ValueError("there is no chunk")
            record, start, length = found
            record.data = self._read(chunk + start, length)
            self._data = chunk, chunk_data(record, self._limits, cut=len(record.data) < length)
        return message_at(self._data[1], position)

    def _read(self, offset: int, count: int) -> bytes:
        return os.pread(self._stream.fileno(), count, offset)


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """Where the samples of one device are: arrays (b,) of its blocks in order, none overlapping."""

    start: NDArray[np.int64]
    length: NDArray[np.int64]
    """Position of a block's first sample, and how many there are."""
    chunk: NDArray[np.int64]
    position: NDArray[np.int64]
    begin: NDArray[np.int64]
    """Where the block was found, and which of its samples is the first."""
    total: int
    """Positions, with those of lost samples."""
    load: Loader
    """Gives a block again."""

    def cut(self, channel: str, start: int, stop: int) -> NDArray[np.float32]:
        """Samples of a channel at positions `start` to before `stop`; lost ones are NaN."""
        values = np.full(max(0, stop - start), np.nan, dtype=np.float32)
        first = max(0, int(np.searchsorted(self.start, start, side="right")) - 1)
        for i in range(first, int(np.searchsorted(self.start, stop))):
            series = self.load(int(self.chunk[i]), int(self.position[i])).get(channel)
            if series is None:
                continue
            at, skipped = int(self.start[i]), int(self.begin[i])
            low, high = max(start, at), min(stop, at + int(self.length[i]))
            if low < high:
                values[low - start : high - start] = series[low - at + skipped : high - at + skipped]
        return values


class StoredSamples(NDArrayOperatorsMixin):
    """One channel's samples (n,), float32, as :class:`recordings.run.Samples`: a slice is an array, read when taken.

    Whatever else is done with them (arithmetic, an array's methods) takes all of them into memory.
    """

    dtype = np.dtype(np.float32)
    ndim = 1

    def __init__(
        self,
        channel: str,
        blocks: Blocks,
        *,
        sign: int = 1,
        changed: tuple[NDArray[np.intp], NDArray[np.float32]] | None = None,
    ) -> None:
        self._channel, self._blocks, self._sign, self._changed = channel, blocks, sign, changed

    @property
    def shape(self) -> tuple[int]:
        """(n,)."""
        return (self._blocks.total,)

    def __len__(self) -> int:
        return self._blocks.total

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, slice):
            start, stop, step = key.indices(len(self))
            return self._cut(start, stop) if step == 1 else self._cut(0, len(self))[key]
        return self._cut(0, len(self))[key] if not isinstance(key, (int, np.integer)) else self._one(int(key))

    def __iter__(self) -> Iterator[np.float32]:
        return iter(self._cut(0, len(self)))

    def __arrow_array__(self, type: Any = None) -> Any:
        import pyarrow

        return pyarrow.array(self._cut(0, len(self)), type=type)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self._cut(0, len(self)), dtype=dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        whole = [np.asarray(each) if isinstance(each, StoredSamples) else each for each in inputs]
        return getattr(ufunc, method)(*whole, **options)

    def __getattr__(self, name: str) -> Any:
        # What else an array can do, the whole of them does; Python's own protocols ask for names of their own.
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._cut(0, len(self)), name)

    def __neg__(self) -> StoredSamples:
        changed = self._changed and (self._changed[0], -self._changed[1])
        return StoredSamples(self._channel, self._blocks, sign=-self._sign, changed=changed)

    def replaced(self, positions: NDArray[np.intp], values: NDArray[np.float32]) -> StoredSamples:
        """The samples with others at some positions (k,), in rising order."""
        if self._changed is not None:
            at = np.concatenate([self._changed[0], positions])
            every, last = np.unique(at[::-1], return_index=True)
            positions, values = every, np.concatenate([self._changed[1], values])[::-1][last]
        return StoredSamples(self._channel, self._blocks, sign=self._sign, changed=(positions, values))

    def _one(self, position: int) -> np.float32:
        at = range(len(self))[position]
        return np.float32(self._cut(at, at + 1)[0])

    def _cut(self, start: int, stop: int) -> NDArray[np.float32]:
        values = self._blocks.cut(self._channel, start, stop)
        if self._sign < 0:
            np.negative(values, out=values)
        if self._changed is not None:
            positions, others = self._changed
            first, last = np.searchsorted(positions, [start, stop])
            values[positions[first:last] - start] = others[first:last]
        return values


def with_samples(samples: Samples, positions: NDArray[np.intp], values: NDArray[np.float32]) -> Samples:
    """Samples with others at some positions (k,), in rising order; those given stay as they are."""
    if isinstance(samples, StoredSamples):
        return samples.replaced(positions, values)
    changed = np.array(samples)
    changed[positions] = values
    return changed


def _opened(path: Path, limits: Limits) -> BlockStore:
    return BlockStore.owning(path, path.open("rb"), limits)


def _size(series: Series) -> int:
    return len(next(iter(series.values()), ()))
