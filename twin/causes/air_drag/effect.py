import numpy as np

from twin.bench.plan import Element, Matrices, Plan
from twin.joint import QuadraticDrag


def air_drag(plan: Plan, *, coefficient_Ns2_per_m3: float) -> None:
    """Resist with c v |v| per metre of length."""

    def elements(matrices: Matrices) -> list[Element]:
        length = plan.layout.length
        x, weight = np.polynomial.legendre.leggauss(4)  # integrate v^2 |v| of the first bending shape to 0.1 %
        return [
            Element(
                matrices.row(plan.layout.place((xi + 1) / 2 * length)),
                QuadraticDrag(coefficient_Ns2_per_m3),
                scale=w / 2 * length,
                velocity=True,
            )
            for xi, w in zip(x, weight, strict=True)
        ]

    plan.element_makers.append(elements)
