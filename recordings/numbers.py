"""Numbers that people write into files, with bounds: what lies beyond is a slip, and would only end in infinity."""

from typing import Annotated

from pydantic import Field

LARGEST = 1e15
"""Of any quantity in SI units: a thousand times the stiffest material's modulus; products of twenty stay finite."""
SMALLEST = 1e-15
"""Of what must not be zero: an atom's size is 1e-10 m; its reciprocal is as far from infinity as the largest."""

Positive = Annotated[float, Field(ge=SMALLEST, le=LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
STIFFEST = 1e13
"""Modulus of elasticity, N/m2; diamond has 1.2e12."""
Modulus = Annotated[float, Field(ge=SMALLEST, le=STIFFEST, allow_inf_nan=False)]
Density = Annotated[float, Field(ge=SMALLEST, le=1e6, allow_inf_nan=False)]
"""kg/m3; osmium has 22 590, and a beam may carry what is not modelled."""
Length = Annotated[float, Field(ge=1e-9, le=1e4, allow_inf_nan=False)]
"""Of a structure or a part of its section, m; no test rig is longer than ten kilometres."""
Mass = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
"""Of what is mounted on a structure, kg; the largest shakers' tables weigh a few tonnes."""
