"""Harmonic balance of the forces that go by a port's own motion, the law of the joints first of all."""

from twin.identify.harmonic_balance.balance import Balance
from twin.identify.harmonic_balance.joint_law import LayerLaw
from twin.identify.harmonic_balance.local_forces import LocalForces
from twin.identify.harmonic_balance.opening_harmonics import Openings
