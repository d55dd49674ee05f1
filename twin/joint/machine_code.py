"""Functions of a law compiled to what the kernels can call."""

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import carray, cfunc, njit
from numba.core.errors import NumbaError

from twin.joint.calling import SIGNATURE

AHEAD = 3
"""Parameters of the kernels before the law's own numbers: two addresses and the length of the memory."""


@lru_cache(maxsize=256)
def machine_code(function: Callable[..., Any], *, fills: bool) -> Any:
    """`function` compiled, with the arguments that the kernels give; kept, so that its address remains valid.

    ValueError if numba cannot compile it.
    """
    compiled = function if hasattr(function, "py_func") else njit(error_model="numpy")(function)
    if fills:

        def called(p, count, memory, states, x, filled):  # type: ignore[no-untyped-def]
            force, tangent = compiled(carray(p, (count,))[AHEAD:], carray(memory, (states,)), x)
            filled[0] = force
            filled[1] = tangent

    else:

        def called(p, count, memory, states, x, filled):  # type: ignore[no-untyped-def]
            compiled(carray(p, (count,))[AHEAD:], carray(memory, (states,)), x)

    try:
        return cfunc(SIGNATURE, error_model="numpy")(called)
    except NumbaError as error:
        # numba tells the way to the error first, in colours
        told = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
        reason = next((line for line in told if line and not line.startswith("Failed in")), "no reason given")
        wanted = "force and tangent" if fills else "nothing"
        raise ValueError(
            f"{function.__name__} is not what numba can compile for (p, memory, x), giving {wanted}: {reason}"
        ) from error
