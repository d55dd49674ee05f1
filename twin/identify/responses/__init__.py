"""Frequency responses that a lab measured with its own programs, as evidence beside broadband runs."""

from twin.identify.responses.evidence import gather_responses
