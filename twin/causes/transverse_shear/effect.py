from twin.bench.plan import Plan


def transverse_shear(plan: Plan, *, beam: str, modulus_ratio: float) -> None:
    """Give one beam the ratio E / (kappa G), beside what it has of it."""
    nominal = plan.beam(beam)
    plan.layout = plan.layout.with_beam(
        beam, youngs_modulus=nominal.youngs_modulus, shear_ratio=nominal.shear_ratio + modulus_ratio
    )
