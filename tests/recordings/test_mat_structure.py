"""A MATLAB file is looked through before scipy sees it: what would crash its reader is refused with the reason."""

from __future__ import annotations

import io
import zlib

import numpy as np
import pytest
import scipy.io

from recordings.convert.mat_structure import check_structure

LIMIT = 1 << 20


def mat_file(*, compressed: bool = False, **arrays: object) -> bytes:
    stream = io.BytesIO()
    scipy.io.savemat(stream, arrays, do_compression=compressed)
    return stream.getvalue()


def check(data: bytes, limit_bytes: int = LIMIT) -> None:
    check_structure(io.BytesIO(data), limit_bytes=limit_bytes)


def test_what_scipy_writes_is_let_through():
    plain = {"text": "abc", "a": np.ones((3, 2)), "b": np.ones((5, 1), np.float32), "n": np.arange(7, dtype=np.int64)}
    check(mat_file(**plain, one=np.float64(3), none=np.ones((0, 2))))
    check(mat_file(compressed=True, **plain))


def test_data_of_a_type_that_does_not_exist_are_refused():
    """This is what takes scipy 1.17 down, and the program with it."""
    good = mat_file(a=np.full((3, 2), 1.5))
    at = good.index(np.array([9, 48], "<u4").tobytes())
    for kind in (0, 14, 15, 99, 0xFFFF):
        with pytest.raises(ValueError, match="data of type"):
            check(good[:at] + np.uint32(kind).tobytes() + good[at + 4 :])


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.array([{"a": 1}], dtype=object), "of class cell"),
        ({"field": 1.0}, "of class struct"),
        (np.array([1 + 2j]), "of class complex"),
    ],
)
def test_what_a_run_does_not_have_is_refused(array, reason):
    with pytest.raises(ValueError, match=reason):
        check(mat_file(a=array))


def test_a_few_bytes_that_claim_much_are_refused_without_unpacking_all():
    bomb = mat_file(compressed=True, a=np.zeros(4 << 20))
    assert len(bomb) < 100_000
    with pytest.raises(ValueError, match="more than"):
        check(bomb)


@pytest.mark.parametrize("compressed", [False, True])
def test_every_cut_is_noticed(compressed):
    good = mat_file(compressed=compressed, a=np.arange(6.0), b="text")
    ends = {128}  # a file may end between two variables
    position = 128
    while position < len(good):
        position += 8 + int(np.frombuffer(good, "<u4", 1, position + 4)[0])
        ends.add(position)
    for length in range(len(good)):
        if length not in ends:
            with pytest.raises(ValueError, match=r"."):
                check(good[:length])


def test_a_compressed_variable_with_something_behind_it_is_refused():
    good = mat_file(compressed=True, a=np.arange(6.0))
    inner = zlib.compress(zlib.decompress(good[136:]) + b"more")
    with pytest.raises(ValueError, match="more or less"):
        check(good[:128] + np.array([15, len(inner)], "<u4").tobytes() + inner)
