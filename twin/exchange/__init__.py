"""Frequency responses for the lab's other programs: arrays for sdypy, universal files for everybody else."""

from twin.exchange.responses import FrequencyResponses, frequency_responses, write_universal

__all__ = ["FrequencyResponses", "frequency_responses", "write_universal"]
