"""The response amplitude X that the joint's law goes by, as the structure has it rather than as a faulty channel reads.

A leak adds to the reference channel below a resonance and takes away above it: one motion would have two amplitudes,
and no law of X would fit.  A wrong gain or place of that channel only stretches the law.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension

__all__ = ["response_amplitude"]

LEAST = 1e-3
"""Share of the amplitude as read that is left however large a leak a search tries."""


def response_amplitude(evidence: Evidence, extension: Extension) -> NDArray[Any]:
    """Amplitude X (s,) of every step, m, with what leaks into the reference channel taken off its reading."""
    steps, names = evidence.steps, evidence.channels
    leaks = [(source, part) for channel, source, part in extension.cross_talk if channel == names[evidence.reference]]
    if not leaks:
        return steps.amplitude_m
    reading = steps.response[:, evidence.reference, 0]
    own = reading
    for source, part in leaks:
        own = own - part * (
            steps.force[:, 0] if source == evidence.force else steps.response[:, names.index(source), 0]
        )
    return np.asarray(steps.amplitude_m * np.maximum(np.abs(own) / np.abs(reading), LEAST))
