"""Responses that are those of another quantity than their channel's label: a vibrometer's velocity as acceleration."""

import math
from dataclasses import replace
from functools import cache
from typing import TypeVar

import numpy as np

from twin.checks.agreement import Agreement, RunBesideModel, agreement_of
from twin.checks.finding import Finding
from twin.checks.responses import NoiseResponse, SineResponse
from twin.checks.thresholds import GAIN, SHAPE

Response = TypeVar("Response", NoiseResponse, SineResponse)

MOTIONS = ("displacement", "velocity", "acceleration")


def look_at_quantities(seen: RunBesideModel, agreement: Agreement) -> list[Finding]:
    """Channels with the level and the shape of the model's response only as another quantity of motion."""

    @cache
    def taken_as(order: int) -> Agreement | None:
        """How all responses, differentiated so many times, compare with the model."""
        derived = [_derived(one, order) for one in seen.noise], [_derived(one, order) for one in seen.sines]
        return agreement_of(*derived, seen.expected)

    findings = []
    for number, output in enumerate(seen.expected.model.outputs):
        if output.quantity not in MOTIONS or _near(agreement, number):
            continue
        for other, name in enumerate(MOTIONS):
            order = MOTIONS.index(output.quantity) - other
            taken = taken_as(order) if order else None
            if taken is not None and _near(taken, number) and not taken.turned[number]:
                found = f"its level is that of a {name}, {taken.level[number]:.2f} times the model's"
                labelled = f"{output.quantity}, as its label says"
                findings.append(Finding(seen.run.path, output.channel, "quantity", labelled, found, "stopped"))
                break
    return findings


def _near(agreement: Agreement, number: int) -> bool:
    return abs(math.log(agreement.level[number])) < math.log(GAIN) and bool(agreement.shape[number] < SHAPE)


def _derived(response: Response, order: int) -> Response:
    """Its responses differentiated so many times."""
    return replace(response, H=response.H * (2j * np.pi * response.frequency_Hz[:, None]) ** order)
