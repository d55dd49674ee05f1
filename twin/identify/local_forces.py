"""Local nonlinear forces beside linear receptances: their equivalent stiffness at the motion that is there.

The stiffness of a port depends on the port's own amplitude, and that on the stiffness: Newton's method on the logarithm
of the amplitude finds both.  The same derivatives say how the port follows any other change of the model; without them
a sensitivity near a slider that begins to slip is wrong by half of itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.extension import JointState, NoiseMotion, NonlinearForce

__all__ = ["Influence", "LocalForces"]

Array = NDArray[Any]

TURNS, SETTLED = 20, 1e-10
LONGEST = 0.7
"""Largest change of a log amplitude in one turn."""
DIFFERENCE = 1e-5
"""Relative step of amplitude or stiffness for a derivative."""


@dataclass(frozen=True)
class Influence:
    """What stiffness at the ports does.

    Attributes
    ----------
    motion : ndarray, (s, n, n)
        d log (complex amplitude of port i) / d (stiffness of port j).
    response : ndarray, (s, o, n)
        d log (response) / d (stiffness of port j).
    """

    motion: Array
    response: Array


@dataclass(frozen=True)
class LocalForces:
    """Nonlinear forces, each on a port of its own."""

    forces: tuple[NonlinearForce, ...]

    def stiffness(self, amplitude: Array, omega: Array) -> Array:
        """Equivalent stiffness (s, n) at amplitudes (s, n)."""
        return np.stack([f.equivalent(amplitude[:, i], omega) for i, f in enumerate(self.forces)], axis=1)

    def growth(self, amplitude: Array, omega: Array) -> Array:
        """Derivative of the stiffness with the logarithm of the amplitude, (s, n)."""
        up, down = (self.stiffness(amplitude * (1 + side * DIFFERENCE), omega) for side in (1, -1))
        return np.asarray((up - down) / (2 * DIFFERENCE))

    @property
    def act_in_noise(self) -> bool:
        """Whether any of them is felt in a broadband run."""
        return any(force.random is not None for force in self.forces)

    def substitutes(self, motion: tuple[NoiseMotion, ...], omega: Array) -> Array:
        """Dynamic stiffness (f, n) of the forces' best linear substitutes under noise that moves their ports so."""
        Z = np.zeros((len(omega), len(self.forces)), complex)
        for i, force in enumerate(self.forces):
            if force.random is not None:
                Z[:, i] = force.random(motion[i], omega)
        return Z

    def balance(
        self, omega: Array, free: Array, attach: Callable[[Array], Array], motion: Callable[[Array], tuple[Array, Any]]
    ) -> Array:
        """Receptances with the forces' stiffness at the amplitudes that they themselves allow.

        Parameters
        ----------
        free : ndarray, (s, p, p)
            Receptances without the forces.
        attach
            Receptances with stiffness (s, n) at the ports.
        motion
            Of receptances: complex amplitudes (s, n) of the ports, and their :class:`Influence`.
        """
        log_a = _log(motion(free)[0])
        for _ in range(TURNS):
            amplitude = np.exp(log_a)
            R = attach(self.stiffness(amplitude, omega))
            z, influence = motion(R)
            gap = _log(z) - log_a
            if np.max(np.abs(gap)) < SETTLED:
                break
            step = np.linalg.solve(self._own(amplitude, omega, influence), gap[:, :, None])[:, :, 0]
            log_a = log_a + np.clip(step, -LONGEST, LONGEST)
        return R

    def follow(
        self, amplitude: Array, omega: Array, influence: Influence, motion: Array, response: Array
    ) -> tuple[Array, Array]:
        """Changes of log motion (s, n, u) and log response (s, o, u) once the stiffness has followed the amplitude.

        Parameters
        ----------
        motion, response
            The same changes at a stiffness that is held.
        """
        followed = np.linalg.solve(self._own(amplitude, omega, influence), motion.real)
        k = self.growth(amplitude, omega)[:, :, None] * followed
        return motion + influence.motion @ k, response + influence.response @ k

    def harmonics(self, motion: Array, count: int, joint: JointState) -> Array:
        """Harmonics 1 ... count (s, n, count) of the forces for complex amplitudes (s, n), in their phase."""
        values = [f.harmonics(np.abs(motion[:, i]), count, joint) for i, f in enumerate(self.forces)]
        return np.stack(values, axis=1) * _turn(motion, count)

    def harmonic_changes(
        self, here: Array, motion: Array, count: int, joint: JointState, log_motion: Array, left: Array
    ) -> Array:
        """Changes (s, n, count, u) of :meth:`harmonics`, now `here`, with log motion (s, n, u) and left (s, u)."""
        by_size = (self.harmonics(motion * (1 + DIFFERENCE), count, joint) - here) / DIFFERENCE
        stiffer = replace(joint, left=joint.left + DIFFERENCE)
        by_left = (self.harmonics(motion, count, stiffer) - here) / DIFFERENCE
        by_phase = 1j * np.arange(1, count + 1) * here
        return np.asarray(
            by_size[..., None] * log_motion.real[:, :, None, :]
            + by_phase[..., None] * log_motion.imag[:, :, None, :]
            + by_left[..., None] * left[:, None, None, :]
        )

    def _own(self, amplitude: Array, omega: Array, influence: Influence) -> Array:
        """1 - d log (amplitude that follows) / d log (amplitude assumed), (s, n, n)."""
        slope = (influence.motion * self.growth(amplitude, omega)[:, None, :]).real
        return np.eye(amplitude.shape[1]) - slope


def _log(motion: Array) -> Array:
    return np.asarray(np.log(np.maximum(np.abs(motion), 1e-300)))


def _turn(motion: Array, count: int) -> Array:
    return np.exp(1j * np.angle(motion)[:, :, None] * np.arange(1, count + 1))
