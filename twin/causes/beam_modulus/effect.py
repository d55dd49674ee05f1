from twin.bench.plan import Plan


def beam_modulus(plan: Plan, *, beam: str, factor: float) -> None:
    """Multiply the Young's modulus of one beam."""
    nominal = plan.beam(beam)
    plan.layout = plan.layout.with_beam(
        beam, youngs_modulus=nominal.youngs_modulus * factor, shear_ratio=nominal.shear_ratio
    )
