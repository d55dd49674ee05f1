"""What every law offers: numbers for the kernels, a path in time, and an equivalent stiffness."""

from typing import ClassVar, Protocol

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
        """Force along the samples of a path that starts at rest at e = 0, in plain numpy."""

    def describing_function(self, amplitude: Array) -> Array:
        """Describing function: complex equivalent stiffness for e = amplitude sin(wt), steady state."""
