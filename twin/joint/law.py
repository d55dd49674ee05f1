"""What every law offers: numbers for the kernels, a path in time, and an equivalent stiffness."""

from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

Series = NDArray[np.float64]
Stiffness = NDArray[np.complex128]


class Law(Protocol):
    """A restoring force f(e) of one local coordinate e, with memory where it has one.

    `parameters` is what the compiled kernels read (their meaning is the kind's own); `states` is the length of the
    memory, which starts at zero.
    """

    kind: ClassVar[int]

    @property
    def parameters(self) -> Series:
        """Numbers for the kernels, 1-D."""

    @property
    def states(self) -> int:
        """How many numbers the law remembers."""

    def force_history(self, e: Series) -> Series:
        """Force along the samples of a path that starts at rest at e = 0, in plain numpy."""

    def describing_function(self, amplitude: Series) -> Stiffness:
        """Describing function: complex equivalent stiffness for e = amplitude sin(wt), steady state."""
