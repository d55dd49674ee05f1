"""The collector rests while kernels are compiled, and then is as it was."""

from __future__ import annotations

import gc

import numba
import pytest

import twin.joint.compilation  # noqa: F401


@pytest.mark.parametrize("collecting", [True, False])
def test_the_collector_is_as_it_was_after_a_compilation_that_works_and_one_that_fails(collecting):
    before = gc.isenabled()
    try:
        (gc.enable if collecting else gc.disable)()
        inner = numba.njit(lambda x: x + 1)
        assert numba.njit(lambda x: inner(x) * 2)(1) == 4
        assert gc.isenabled() == collecting
        with pytest.raises(numba.TypingError):
            numba.njit(lambda x: x.missing)(1)
        assert gc.isenabled() == collecting
    finally:
        (gc.enable if before else gc.disable)()
