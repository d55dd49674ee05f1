"""Steady responses of the reduced rig by harmonic balance, an independent reference for the marching bench."""

from twin.response.balance import HarmonicBalance, PeriodicSolution

__all__ = ["HarmonicBalance", "PeriodicSolution"]
