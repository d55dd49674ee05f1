"""What every law offers: numbers for the kernels, a path in time, and an equivalent stiffness."""

from typing import ClassVar, Protocol

import numpy as np

from twin.arrays import Array


class Law(Protocol):
    """A restoring force f(e) of one local coordinate e, with memory where it has one.

    `parameters` is what the compiled kernels read (their meaning is the kind's own); `states` is the length of the
    memory, which starts at zero.
    """

    kind: ClassVar[int]

    @property
    def parameters(self) -> Array:
        """Numbers for the kernels, 1-D."""

    @property
    def states(self) -> int:
        """How many numbers the law remembers."""

    def force_history(self, e: Array) -> Array:
        """Force along the samples of a path that starts at rest at e = 0."""

    def describing_function(self, amplitude: Array) -> Array:
        """Describing function: complex equivalent stiffness for e = amplitude sin(wt), steady state."""


class Marched:
    """A law whose path is what the kernels make of it."""

    def force_history(self: Law, e: Array) -> Array:
        """Force along a path."""
        from twin.joint.kernel import along  # which numba takes a while to load

        e = np.asarray(e, float)
        state = np.zeros((1, max(self.states, 1)))
        return np.asarray(along(self.kind, self.parameters[None], state, e.ravel())).reshape(e.shape)
