from twin.bench.plan import Plan


def added_mass(
    plan: Plan,
    *,
    mass_kg: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    mass: str = "",
) -> None:
    """Fix a point mass to the structure; where it changes one that the rig file lists, `mass` is that one's name."""
    place = plan.place(position_m=position_m, part=part, node=node)
    plan.matrix_changes.append(lambda matrices: matrices.add_mass(place, mass_kg))
