"""Pieces back in order: nothing invented, nothing twice, every loss accounted for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drivers.host.reassembly import CAPACITY, Piece, Reassembler


def pieces_of(reassembler: Reassembler, step: int, stop: int) -> list[Piece]:
    out = []
    for at in range(step, stop + step, step):
        out += reassembler.take(at)
    return out


@given(st.integers(1, 3), st.lists(st.sampled_from(["ok", "lost", "late", "twice"]), min_size=1, max_size=40))
def test_what_comes_out_is_what_was_sent_or_counted_as_lost(channels, fates):
    size = 7
    truth = np.arange(channels * size * len(fates), dtype=np.float32).reshape(channels, -1)
    reassembler = Reassembler(channels, tolerance=size * 2)
    order: list[int] = []
    for i, fate in enumerate(fates):
        order += {"ok": [i], "lost": [], "late": [], "twice": [i, i]}[fate]
        if i and fates[i - 1] == "late":
            order.append(i - 1)  # one frame later than it should
    for i in order:
        for row in range(channels):
            reassembler.put(slice(row, row + 1), i * size, truth[row : row + 1, i * size : (i + 1) * size])
    out = pieces_of(reassembler, 10, truth.shape[1])
    position = 0
    arrived = set(order)
    for piece in out:
        assert piece.first_index == position
        position += piece.count
        whole = all(k // size in arrived for k in range(piece.first_index, min(position, truth.shape[1])))
        if piece.values is not None:
            assert whole
            assert np.array_equal(piece.values, truth[:, piece.first_index : position])
        else:
            assert not whole or position > truth.shape[1]
    delivered = sum(piece.count for piece in out if piece.values is not None)
    assert delivered == size * len(arrived)
    assert reassembler.repeated == size * channels * (len(order) - len(arrived))
    late = {b for k, b in enumerate(order) if b < max(order[:k], default=-1) and b not in order[:k]}
    assert reassembler.late == size * channels * len(late)


def test_a_block_waits_for_a_late_piece_but_not_for_ever():
    reassembler = Reassembler(1, tolerance=20)
    ten = np.ones((1, 10), np.float32)
    reassembler.put(slice(None), 10, ten)
    assert reassembler.ready == 0
    reassembler.put(slice(None), 20, ten)
    assert reassembler.ready == 10  # twenty samples later it is given up
    assert [(piece.count, piece.values is None) for piece in reassembler.take(30)] == [(10, True), (20, False)]
    assert not reassembler.put(slice(None), 0, ten)
    assert reassembler.repeated == 10


def test_a_sample_missing_in_one_channel_is_missing():
    reassembler = Reassembler(2, tolerance=0)
    reassembler.put(slice(0, 1), 0, np.ones((1, 30), np.float32))
    reassembler.put(slice(1, 2), 0, np.ones((1, 10), np.float32))
    reassembler.put(slice(1, 2), 20, np.ones((1, 10), np.float32))
    assert [(p.first_index, p.count, p.values is None) for p in reassembler.take(30)] == [
        (0, 10, False), (10, 10, True), (20, 10, False),
    ]  # fmt: skip


def test_a_jump_beyond_memory_is_a_loss_and_costs_no_memory():
    reassembler = Reassembler(1, tolerance=0)
    ten = np.ones((1, 10), np.float32)
    reassembler.put(slice(None), 0, ten)
    far = 10 * CAPACITY
    reassembler.put(slice(None), far, ten)
    out = reassembler.take(far + 10)
    assert [(p.first_index, p.count, p.values is None) for p in out] == [
        (0, 10, False), (10, far - 10, True), (far, 10, False),
    ]  # fmt: skip
    assert reassembler._values.shape[1] <= CAPACITY
