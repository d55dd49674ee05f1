"""The layer's own opening and slip at each step, as the amplitudes X at which the first mode opens and slips it so.

A joint's law goes by what its layer does.  At resonance the amplitude X of a sensor tells that; beside it the drive
force and the other modes move the layer too, and at one X it opens and slips by parts in a hundred more above the
resonance than below.  Scaling X with the square of the frequency leaves parts in a thousand of that
(:mod:`twin.identify.nonlinear.joint_law`), several standard deviations of a polynomial's coefficients.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.layer_response import LayerResponse

__all__ = ["LayerMotion", "layer_motion"]

Array = NDArray[Any]

APART = 1e-3
"""Relative distance of the frequencies from which a resonance is extrapolated."""


@dataclass(frozen=True)
class LayerMotion:
    """Shares (s,) of each step's X: times these it is the X at which the first mode alone opens or slips the layer so.

    Attributes
    ----------
    opening, slip : ndarray, (s,)
        By the root-mean-square over the layer.
    """

    opening: Array
    slip: Array

    def pick(self, rows: Array) -> LayerMotion:
        """Those of the steps `rows`."""
        return LayerMotion(self.opening[rows], self.slip[rows])


def layer_motion(
    layer: LayerResponse,
    layer_at: Callable[[Array], LayerResponse],
    omega: Array,
    dE: Array,
    dG: Array,
    *,
    output: int,
) -> LayerMotion:
    """Compare the layer's motion per motion of a sensor at the steps with that in the first mode.

    Parameters
    ----------
    layer
        The rig's receptances at the steps' own frequencies.
    layer_at
        From any commanded frequencies (s,) of the steps to those there.
    omega : ndarray, (s,)
        The steps' own.
    dE, dG : ndarray, (s,)
        Complex changes of the moduli at each step's amplitude.
    output
        The sensor's place among the outputs.
    """
    response = _per_output(layer, dE, dG, output)
    beside, near, resonance = omega, response, omega * (1 + APART)
    for _ in range(3):
        # Near a resonance the inverse of a receptance falls linearly with omega^2, by a complex constant.
        there = _per_output(layer_at(resonance), dE, dG, output)
        inverse = 1 / near.receptance
        fall = (1 / there.receptance - inverse) / (resonance**2 - beside**2)
        found = np.sqrt(np.real(beside**2 - inverse / fall))
        beside, near, resonance = resonance, there, found
    mode = _per_output(layer_at(resonance), dE, dG, output)
    scale = (resonance / omega) ** 2
    return LayerMotion(response.opening / mode.opening * scale, response.slip / mode.slip * scale)


@dataclass(frozen=True)
class _PerOutput:
    """A sensor's displacement per force, and the layer's root-mean-square opening and slip per displacement there."""

    receptance: Array
    opening: Array
    slip: Array


def _per_output(layer: LayerResponse, dE: Array, dG: Array, output: int) -> _PerOutput:
    p = layer.residual_model.model.ports
    strains, outputs = layer.by_drive(dE, dG)
    receptance = outputs[:, output]
    # The ports' common factor from strain to metres cancels in the comparison.
    opening, slip = (np.linalg.norm(part, axis=1) for part in np.split(strains, [len(p.normals[0])], axis=1))
    return _PerOutput(receptance, opening / np.abs(receptance), slip / np.abs(receptance))
