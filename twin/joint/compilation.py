"""How kernels are compiled that keep the order of rounding, and what rests while any are."""

import gc
from typing import Any

import numba
from numba.core import event

OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
COMPILED = numba.njit(**OPTIONS)
"""How the kernels of the fits are compiled: rounding is not reordered."""
INSIDE: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True}
INNER = numba.njit(**INSIDE)
"""How those are compiled that kernels alone call: an entry for Python takes longer to compile than many of them."""


class _RestOfCollector(event.Listener):
    """Python's search for garbage in cycles rests while anything is compiled: it takes a tenth of the time."""

    _depth, _collecting = 0, False

    def on_start(self, event: Any) -> None:
        """One kernel begins, maybe inside another."""
        if self._depth == 0:
            self._collecting = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """It has ended, however it did."""
        self._depth -= 1
        if self._depth == 0 and self._collecting:
            gc.enable()


event.register("numba:compile", _RestOfCollector())
