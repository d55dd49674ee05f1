"""A law given by functions of Python that numba compiles.

::

    @njit
    def force(p, memory, x):      # numbers of the law, its memory, the coordinate: force and tangent
        return p[0] * x, p[0]

    @njit
    def remember(p, memory, x):   # changes the memory to what it is after a step that ended at x
        memory[0] = x

Both may use what numba compiles: numbers, arrays, `math`, other such functions.  `memory` is as the last step left it,
so that `force` may be asked for many x within one step.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.describing_function import describing_function
from twin.joint.kinds import FUNCTIONS
from twin.joint.law import Law, Marched

Force = Callable[[Array, Array, float], tuple[float, float]]
Remember = Callable[[Array, Array, float], None]


@dataclass(frozen=True, eq=False)
class FunctionLaw(Marched):
    """A law whose force and memory are functions."""

    kind: ClassVar[int] = FUNCTIONS
    force: Force
    numbers: tuple[float, ...]
    """What `force` and `remember` get as `p`."""
    remember: Remember | None = None
    states: int = 0
    """Length of the memory, which begins at zero."""
    describing: Callable[[Array], Array] | None = field(default=None)
    """Equivalent stiffness over an amplitude, if there is a closed form; otherwise by quadrature."""

    @property
    def parameters(self) -> Array:
        """[address of force, address of remember or 0, states, numbers]: of this process alone."""
        from twin.joint.machine_code import machine_code  # which numba takes a while to load

        remember = machine_code(self.remember, fills=False).address if self.remember else 0
        return np.array([machine_code(self.force, fills=True).address, remember, self.states, *self.numbers], float)

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness."""
        if self.describing is None:
            return describing_function(self.force_history, amplitude)
        return np.asarray(self.describing(np.asarray(amplitude, float)), complex)


def law_of_functions(
    force: Force, *, remember: Remember | None = None, states: int = 0, stiffness: Callable[..., Array] | None = None
) -> Callable[..., Law]:
    """What makes a law of these functions from the values of its parameters, for :class:`twin.joint.NamedLaw`.

    Parameters
    ----------
    force
        Of numbers p in the order of the law's parameters, memory and coordinate x: force and tangent.
    remember
        Of the same: changes the memory.
    states
        Length of the memory.
    stiffness
        Describing function of an array of amplitudes, with the parameters by name; by quadrature if left out.

    Notes
    -----
    The law is made with one number a parameter.  Making it raises ValueError where numba cannot compile its functions,
    or there is a force at rest.
    """

    def make(**values: float) -> FunctionLaw:
        closed = None if stiffness is None else lambda amplitude: stiffness(amplitude, **values)
        law = FunctionLaw(force, tuple(map(float, values.values())), remember, states, closed)
        at_rest = float(law.force_history(np.zeros(1))[0])
        if at_rest != 0.0:
            raise ValueError(f"{force.__name__} is {at_rest:g} where the joint rests, and must be zero there")
        return law

    return make
