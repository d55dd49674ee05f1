"""The papers' polynomial law in its exact time form.

The stiffness term c |e|^k e has the describing function c X^k (2/sqrt(pi)) Gamma((k+3)/2)/Gamma((k+4)/2), and the
rate-independent loss c |e|^(k+1) sign(de/dt) has j 4 c X^k / (pi (k+2)); so any polynomial E' - g1(X) + j g2(X) has a
time form, term by term.
"""

from dataclasses import dataclass
from math import gamma, pi, sqrt
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import POLYNOMIAL
from twin.joint.law import Marched


def storage_ratio(k: int) -> float:
    """Describing function of |e|^k e over X^k."""
    return 2.0 / sqrt(pi) * gamma((k + 3) / 2) / gamma((k + 4) / 2)


def loss_ratio(k: int) -> float:
    """Imaginary part of the describing function of |e|^(k+1) sign(de/dt) over X^k."""
    return 4.0 / (pi * (k + 2))


@dataclass(frozen=True)
class Polynomial(Marched):
    """Stiffness sum_k storage[k] X^k + j sum_k loss[k] X^k for a coordinate of amplitude X.

    `stick` is the travel over which the loss reverses its sign: zero is the exact law, which jumps at reversals; the
    compiled kernels want a travel that their steps resolve.
    """

    kind: ClassVar[int] = POLYNOMIAL
    states: ClassVar[int] = 2
    storage: tuple[float, ...]
    loss: tuple[float, ...] = ()
    stick: float = 0.0

    @property
    def parameters(self) -> Array:
        """[stick, n, time-form storage coefficients, n, time-form loss coefficients]."""
        storage = [c / storage_ratio(k) for k, c in enumerate(self.storage)]
        loss = [c / loss_ratio(k) for k, c in enumerate(self.loss)]
        return np.array([self.stick, len(storage), *storage, len(loss), *loss], float)

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness: the polynomials."""
        X = np.asarray(amplitude, float)
        return np.polyval([0.0, *self.storage[::-1]], X) + 1j * np.polyval([0.0, *self.loss[::-1]], X)
