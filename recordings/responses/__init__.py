"""Frequency responses and modal tables that a lab already has: universal files, CSV, NumPy archives."""

from recordings.responses.found import End, FoundModes, FoundResponse, Responses
from recordings.responses.read import are_responses, read_responses

__all__ = ["End", "FoundModes", "FoundResponse", "Responses", "are_responses", "read_responses"]
