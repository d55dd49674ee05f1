"""Steady responses of the reduced rig by harmonic balance, an independent reference for the marching bench."""

from twin.response.harmonic_balance import HarmonicBalance
from twin.response.solutions import Failure, PeriodicSolution, SolutionBranch, SolutionSweep
